"""What does not work with what: for each such cell of the table the words that its refusal has.

A cell that is not here works. `REASONS` are the sentences that the documentation gives.
"""

SUMS = "give it system.in_gap_coordinates"
SURFACES = "a page cannot show surfaces yet"
RUBBING = "a page cannot show frictions in contacts yet"
FIRST_ORDER = "a page cannot show coordinates of first order yet"

EXTREMA = "give system.in_gap_coordinates"
MANY = "lyapunov_many works on models with one coordinate"

DIAGRAM = "are not drawn in diagrams yet"

RELAYS = "does not follow relays so far"
DISTANCES = "does not follow contacts of a distance"
SEVERAL_COORDINATES = (
    "smooth",
    "smooth, square wave",
    "impact pair",
    "both layers",
    "chain of cells",
    "structure with a contact",
    "structure with a soft stop",
    "structure with a function",
    "own, gaps between bodies",
    "own, with surfaces",
    "own, friction in a contact",
    "own, curved gaps",
    "own, first order",
    "own, two feet that rub",
)
REFUSED = {
    **{(name, "of an ensemble"): MANY for name in SEVERAL_COORDINATES},
    ("own, gaps between bodies", "its extrema"): EXTREMA,
    ("own, curved gaps", "its extrema"): EXTREMA,
    ("own, gaps between bodies", "page"): SUMS,
    ("own, curved gaps", "page"): SUMS,
    ("structure with a soft stop", "page"): SURFACES,
    ("structure with a function", "page"): SURFACES,
    ("own, with surfaces", "page"): SURFACES,
    ("own, friction in a contact", "page"): RUBBING,
    ("own, first order", "page"): FIRST_ORDER,
    ("belt, no load", "diagram"): DIAGRAM,
    ("own, two feet that rub", "page"): DISTANCES,
    ("own, switches", "page"): SURFACES,
    ("own, switches", "of an ensemble"): MANY,
    ("structure with a relay", "diagram"): RELAYS,
    ("structure with a relay", "of an ensemble"): RELAYS,
    ("structure with a relay", "fit"): RELAYS,
    ("structure with a relay", "page"): RELAYS,
    ("own, relays", "diagram"): RELAYS,
    ("own, relays", "of an ensemble"): RELAYS,
    ("own, relays", "fit"): RELAYS,
    ("own, relays", "page"): RELAYS,
}
REASONS = {
    SUMS: (
        "A page needs a coordinate for each gap: `saltus.page(system.in_gap_coordinates)` makes"
        " one."
    ),
    SURFACES: "A page cannot show surfaces yet.",
    RUBBING: "A page cannot show frictions in contacts yet.",
    EXTREMA: (
        "Extrema of ensembles need a coordinate for each gap: give `system.in_gap_coordinates`."
    ),
    MANY: "`lyapunov_many` is for models with one coordinate; `lyapunov_spectrum` takes any.",
    FIRST_ORDER: "A page cannot show coordinates of first order yet.",
    DIAGRAM: "Cycles without a load are not drawn in diagrams yet; `continue_orbit` follows them.",
    DISTANCES: "A page cannot show contacts of a `distance` and frictions of a `rate` yet.",
    RELAYS: (
        "Relays, and surfaces that reset the state, are not followed there yet; `frequency_sweep`,"
        " `continue_orbit` and `lyapunov_spectrum` follow them."
    ),
}
