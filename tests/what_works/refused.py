"""What does not work with what: for each such cell of the table the words that its refusal has.

A cell that is not here works. `REASONS` are the sentences that the documentation gives.
"""

SUMS = "give it system.in_gap_coordinates"
SURFACES = "a page follows no surfaces so far"
RUBBING = "a page follows no frictions in contacts so far"
FIRST_ORDER = "a page follows no coordinates of first order so far"

EXTREMA = "give system.in_gap_coordinates"
MANY = "lyapunov_many works on models with one coordinate"

SEVERAL_COORDINATES = (
    "smooth",
    "impact pair",
    "both layers",
    "chain of cells",
    "structure with a contact",
    "structure with a soft stop",
    "own, gaps between bodies",
    "own, with surfaces",
    "own, friction in a contact",
    "own, curved gaps",
    "own, first order",
)
REFUSED = {
    **{(name, "of an ensemble"): MANY for name in SEVERAL_COORDINATES},
    ("own, gaps between bodies", "its extrema"): EXTREMA,
    ("own, curved gaps", "its extrema"): EXTREMA,
    ("own, gaps between bodies", "page"): SUMS,
    ("own, curved gaps", "page"): SUMS,
    ("structure with a soft stop", "page"): SURFACES,
    ("own, with surfaces", "page"): SURFACES,
    ("own, friction in a contact", "page"): RUBBING,
    ("own, first order", "page"): FIRST_ORDER,
}
REASONS = {
    SUMS: (
        "A page works in coordinates that contacts hold one by one: "
        "`saltus.page(system.in_gap_coordinates)` makes one."
    ),
    SURFACES: "A page follows no surfaces so far.",
    RUBBING: "A page follows no frictions in contacts so far.",
    EXTREMA: (
        "Extrema of ensembles are those of coordinates that contacts hold one by one: give"
        " `system.in_gap_coordinates`."
    ),
    MANY: "`lyapunov_many` is for models with one coordinate; `lyapunov_spectrum` takes any.",
    FIRST_ORDER: "A page follows no coordinates of first order so far.",
}
