"""Systems: the contract of a model, the models, their loads and impact laws, and the system that
joins the three.

Every class here is frozen, dimensionless and pure; `UnitCell` converts from and to SI. Nothing here
integrates anything.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
