! The smoothed metainterface under load (i), for AUTO-07p: `gov_eqn_theta` and `loadpatha` of the paper with `smoothing`,
!
!   theta'' = sin(q theta + beta0) H x + q cos(q theta + beta0) V - C theta' - theta,    q = tanh(B theta / 2),
!
! where x = sin(Omega t), y = cos(Omega t) is the limit cycle of an oscillator of its own, so that AUTO finds multipliers:
!
!   x' = x + Omega y - x (x^2 + y^2),    y' = y - Omega x - y (x^2 + y^2).
!
! U = (theta, theta', x, y). PAR: 1 Omega, 2 H, 3 B, 4 V, 5 C, 6 beta0, 11 the period; 8 the largest |theta| and 9 the mean of
! theta, which are only reported. The parameters come from the constants, the first orbit from smoothed.dat.

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: q, dq, angle, dangle, radius2

  q = tanh(par(3) * u(1) / 2)
  angle = q * u(1) + par(6)
  radius2 = u(3)**2 + u(4)**2
  f(1) = u(2)
  f(2) = sin(angle) * par(2) * u(3) + q * cos(angle) * par(4) - par(5) * u(2) - u(1)
  f(3) = u(3) + par(1) * u(4) - u(3) * radius2
  f(4) = u(4) - par(1) * u(3) - u(4) * radius2
  if (ijac == 0) return

  dq = par(3) / 2 * (1 - q**2)
  dangle = q + u(1) * dq
  dfdu = 0
  dfdu(1, 2) = 1
  dfdu(2, 1) = (cos(angle) * par(2) * u(3) - q * sin(angle) * par(4)) * dangle + dq * cos(angle) * par(4) - 1
  dfdu(2, 2) = -par(5)
  dfdu(2, 3) = sin(angle) * par(2)
  dfdu(3, 3) = 1 - radius2 - 2 * u(3)**2
  dfdu(3, 4) = par(1) - 2 * u(3) * u(4)
  dfdu(4, 3) = -par(1) - 2 * u(3) * u(4)
  dfdu(4, 4) = 1 - radius2 - 2 * u(4)**2
  if (ijac == 1) return

  dfdp(:, 1) = (/ 0d0, 0d0, u(4), -u(3) /)  ! Omega is the only free parameter
end subroutine func

subroutine pvls(ndim, u, par)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(in) :: u(ndim)
  double precision, intent(inout) :: par(*)
  double precision, external :: getp

  par(8) = max(getp('MAX', 1, u), -getp('MIN', 1, u))
  par(9) = getp('INT', 1, u)
end subroutine pvls

subroutine stpnt
end subroutine stpnt

subroutine bcnd
end subroutine bcnd

subroutine icnd
end subroutine icnd

subroutine fopt
end subroutine fopt
