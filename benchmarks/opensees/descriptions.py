"""What the reference problems are, and what is published about them; every file of references says it."""

PLATFORM = (
    "; five steps (the answer does not depend on them, to 1e-10); platform of stiff corotational beams, "
    "extrapolated in 1/stiffness from 1e7 and 1e8 times the limbs'"
)
BEND = (
    "Bathe and Bolourchi (1979), IJNME 14, 961-986: 45° arc of radius 100 in the x-y plane from the origin along y, "
    "clamped there; unit square, E = 1e7, nu = 0, torsion constant = polar moment; dead tip force along z"
)
ANGLE = (
    "Clamped at the origin, 0.2 m along x, then 0.15 m along y; rectangle 4 mm in the plane by 2 mm, E = 70 GPa, "
    "nu = 0.3, shear coefficient 5/6, Saint-Venant torsion; dead tip force; SI"
)
LEE = {
    "what": "Two members of 120 cm at a right angle, both far ends pinned: (0, 0)-(0, 120)-(120, 120); dead load down "
    "on the beam 24 cm from the corner; 3 cm x 2 cm, E = 7.2e6 N/cm^2; N and cm; meshes are elements per 24 cm; "
    "stages of control: v to -55, u by +40, rotation by +0.1, v by -10",
    "citation": "Lee, Manuel and Rossow (1968), J. Eng. Mech. Div. ASCE 94, 521-547",
    "published": "not seen in print by us; E = 7.2e6, A = 6, I = 2 as Simo and Vu-Quoc (1986) and later authors take",
}
WILLIAMS = {
    "what": "Clamped toggle, half span 12.943 in, rise 0.386 in, EA = 1.885e6 lb, EI = 9.27e3 lb in^2, load down on "
    "the apex; lb and in; meshes are elements per member",
    "citation": "Williams (1964), Q. J. Mech. Appl. Math. 17, 451-469; data as in Wood and Zienkiewicz (1977)",
    "published": "curves only, not seen in print by us; a limit load near 34 lb is quoted everywhere",
}
WILLIAMS_SHORT = {**WILLIAMS, "what": WILLIAMS["what"].replace("12.943", "12.936")}
ARCH = {
    "what": "Circular arch of 215 degrees, R = 100, EI = 1e6, EA = 1e8; left end clamped, right end hinged; apex load "
    "down; meshes are elements on each half",
    "citation": "DaDeppo and Schmidt (1975), J. Appl. Mech. 42, 894-896, doi 10.1115/1.3423734",
    "published": {
        "DaDeppo_Schmidt_1975_inextensible_P_R2_over_EI": 8.97,
        "Ibrahimbegovic_1995_EA_100_EI_curved_3_node": 897.3,
    },
}
ARCH_STIFF = {**ARCH, "what": ARCH["what"].replace("1e8", "1e10, nearly inextensible")}
