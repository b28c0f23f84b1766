"""What users take away: pictures, decks of other programs, measured curves, laws of a fabric. Optional."""

from knitstudy.registry import OptionalPackage

OPTIONAL_PACKAGE = OptionalPackage(
    commands={
        "loop": ("knitstudy.use.commands.loop:loop", "Draw and optimise a loop for spacings and a yarn."),
        "stitches": (
            "knitstudy.use.commands.loop:stitches",
            "Read the repeat of a file for a knitting machine.",
        ),
        "show": ("knitstudy.use.commands.show:show", "Show, compare or draw result files."),
        "sheet": (
            "knitstudy.use.commands.sheet:sheet",
            "Print all numbers of a fabric, and write them as a page.",
        ),
        "compare": ("knitstudy.use.commands.curves:compare", "Compare a result with a measured curve."),
        "fit": ("knitstudy.use.commands.curves:fit", "Find modulus and friction from a measured curve."),
        "membrane": ("knitstudy.use.commands.membrane:membrane", "Fit the law of a fabric to its cells."),
        "strip": (
            "knitstudy.use.commands.membrane:strip",
            "Pull a strip between clamps by the law of its fabric.",
        ),
        "export": (
            "knitstudy.use.commands.show:export",
            "Write a scene for Abaqus or CalculiX, a history for ParaView.",
        ),
    },
    exports={
        "mesh_vtu": "knitstudy.use.vtu:write_mesh",
        "series": "knitstudy.use.vtu:write_series",
        "deck_abaqus": "knitstudy.use.decks.inp:write_abaqus",
        "deck_calculix": "knitstudy.use.decks.inp:write_calculix",
        "shell_section": "knitstudy.use.decks.fabric:write_shell",
    },
    names={
        "plot": "knitstudy.use.plot:plot",
        "fabric_sheet": "knitstudy.use.fabric_sheet:fabric_sheet",
    },
)
