"""The kinds of set-ups. Lengths are of the order of 1, moduli of 100 to 100,000."""

import dataclasses

STEPS = 8


@dataclasses.dataclass
class Setup:
    kind: str
    case: dict
    #: Overall size, a search radius that is large enough.
    size: float
    #: Whether the two sides of every pair may be exchanged.
    swappable: bool = True
    meshes: dict = dataclasses.field(default_factory=dict)

    @property
    def has_components(self):
        return any("components" in support for support in self.case["dirichlet"])


# materials, methods, small pieces

def material(r, modulus=None, large=True):
    e = round(modulus or 10 ** r.uniform(2, 5), 1)
    nu = round(r.uniform(0.0, 0.4), 3)
    elastic = {"youngs_modulus": e, "poisson_ratio": nu}
    choice = r.random()
    if choice < 0.5 or not large:
        return {"neo_hooke": elastic}
    if choice < 0.65:
        return {"neo_hooke": {"form": r.choice(["ln", "isochoric"]), **elastic}}
    if choice < 0.8:
        mu, bulk = e / (2 + 2 * nu), e / (3 - 6 * nu)
        return {"mooney_rivlin": {"c10": 0.4 * mu, "c01": 0.1 * mu, "bulk_modulus": bulk}}
    return {"st_venant_kirchhoff": elastic} if choice < 0.9 else {"neo_hooke": elastic}


def pair_of_materials(r):
    """Stiffness ratios from 1 to 100."""
    base = 10 ** r.uniform(2, 4)
    ratio = r.choice([1.0, 1.0, 3.0, 10.0, 100.0])
    moduli = [base, base * ratio]
    r.shuffle(moduli)
    return [material(r, e) for e in moduli]


def friction(r):
    return r.choice([0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.3])


def contact(r, slave, master, mu=None):
    method = r.choice(["lagrange", "lagrange", "penalty", "augmented"])
    pair = {"slave": slave, "master": master, "friction": friction(r) if mu is None else mu, "enforcement": {method: {}}}
    if r.random() < 0.2 and method != "penalty":
        pair["multiplier_shape"] = "dual"
    return pair


def element(r, body):
    if r.random() < 0.25:
        body["element"] = "f_bar"
    return body


def box(name, low, high, elements, law):
    return {"name": name, "box": {"min": low, "max": high, "elements": elements}, "material": law}


def fixed(name):
    return {"set": name}


def moved(name, *waypoints):
    return {"set": name, "motion": [{"t": t, "u": u} for t, u in waypoints]}


def case(bodies, contacts, supports, loads=(), surfaces=(), steps=STEPS):
    out = {"body": bodies}
    if surfaces:
        out["surface"] = list(surfaces)
    out["contact"] = contacts
    out["dirichlet"] = supports
    if loads:
        out["load"] = list(loads)
    out["load_path"] = {"steps": steps}
    return out


def cap(name, body, down=True, degrees=60.0):
    return {"name": name, "body": body, "normal": {"direction": [0.0, -1.0 if down else 1.0, 0.0], "degrees": degrees}}


def slab(r, law, top=0.0, size=(4.0, 0.8, 2.0), name="slab", finer=0):
    n = [r.randint(5, 8) + finer, 2, r.randint(3, 4) + finer]
    low = [-size[0] / 2, top - size[1], -size[2] / 2]
    return box(name, low, [size[0] / 2, top, size[2] / 2], n, law)


# kinds

def block_on_slab(r):
    soft, hard = pair_of_materials(r)
    w, h = r.uniform(0.6, 1.6), r.uniform(0.4, 1.0)
    block = box("block", [-w / 2, 0.0, -0.5], [w / 2, h, 0.5], [r.randint(2, 5), 2, r.randint(2, 4)], hard)
    depth, slide = 0.05 * h, r.uniform(0.0, 0.5)
    motion = moved("block_ymax", (0.4, [0.0, -depth, 0.0]), (1.0, [slide, -depth, r.uniform(-0.2, 0.2)]))
    return Setup("block on slab", case([slab(r, soft), element(r, block)], [contact(r, "block_ymin", "slab_ymax")],
                 [fixed("slab_ymin"), motion]), 5.0)


def ball_on_slab(r):
    soft, hard = pair_of_materials(r)
    radius = r.uniform(0.5, 0.9)
    ball = {"name": "ball", "half_ball": {"radius": radius, "elements": [2, 2, r.randint(2, 3)]}, "material": hard,
            "place": {"translate": [0.0, radius, 0.0]}}
    depth = r.uniform(0.05, 0.15) * radius
    motion = moved("ball_flat", (0.4, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.0, 0.6), -depth, 0.1]))
    return Setup("ball on slab", case([slab(r, soft), ball], [contact(r, "ball_dome", "slab_ymax")],
                 [fixed("slab_ymin"), motion]), 5.0)


def ring_on_slab(r):
    soft, hard = pair_of_materials(r)
    outer = r.uniform(0.5, 0.9)
    ring = {"name": "ring", "half_ring": {"inner_radius": r.uniform(0.4, 0.7) * outer, "outer_radius": outer,
            "width": 1.0, "elements": [r.randint(10, 16), 2, 2]}, "material": hard,
            "place": {"translate": [-0.4, outer, 0.0]}}
    depth = r.uniform(0.03, 0.12) * outer
    motion = moved("ring_ends", (0.4, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.2, 0.8), -depth, 0.0]))
    return Setup("ring on slab", case([slab(r, soft), ring], [contact(r, "ring_outer", "slab_ymax")],
                 [fixed("slab_ymin"), motion]), 5.0)


def stack(r):
    laws = [material(r, 10 ** r.uniform(2, 4)) for _ in range(3)]
    gap = r.choice([0.0, 0.0, 0.02])
    first = box("first", [-1.0, gap, -0.6], [1.0, gap + 0.5, 0.6], [r.randint(3, 5), 2, 2], laws[1])
    second = box("second", [-0.9, 2 * gap + 0.5, -0.55], [1.1, 2 * gap + 1.0, 0.6], [r.randint(3, 5), 2, 3], laws[2])
    depth = 2 * gap + 0.06
    motion = moved("second_ymax", (0.4, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.0, 0.6), -depth, 0.0]))
    return Setup("stack", case([slab(r, laws[0]), first, second],
                 [contact(r, "first_ymin", "slab_ymax"), contact(r, "second_ymin", "first_ymax")],
                 [fixed("slab_ymin"), motion]), 5.0)


def between_tools(r):
    soft = material(r, 10 ** r.uniform(2, 4))
    radius, shape = r.uniform(0.4, 0.7), r.choice(["ball", "cone", "box"])
    if shape == "ball":
        mid = {"name": "mid", "ball": {"radius": radius, "elements": [2, 1, 2]}, "material": soft,
               "place": {"translate": [0.0, radius, 0.0]}}
        surfaces = [cap("dn", "mid"), cap("up", "mid", False)]
    elif shape == "cone":
        mid = {"name": "mid", "cone": {"bottom_radius": radius, "top_radius": r.choice([1.0, 0.7]) * radius,
               "height": 2 * radius, "elements": [2, 2, 3]}, "material": soft}
        surfaces = [{"name": "dn", "body": "mid", "within": "mid_bottom"}, {"name": "up", "body": "mid", "within": "mid_top"}]
    else:
        mid = box("mid", [-radius, 0.0, -radius], [radius, 2 * radius, radius], [3, 3, 3], soft)
        surfaces = [{"name": "dn", "body": "mid", "within": "mid_ymin"}, {"name": "up", "body": "mid", "within": "mid_ymax"}]
    tools = []
    for name, low in [("lo", -0.3), ("hi", 2 * radius)]:
        tool = box(name, [-1.5, low, -1.0], [1.5, low + 0.3, 1.0], [2, 1, 2], None)
        del tool["material"]
        tools.append({**tool, "rigid": {}})
    depth = r.uniform(0.05, 0.2) * radius
    motion = moved("hi", (0.4, [0.0, -depth, 0.0]), (1.0, [r.choice([0.0, 0.1, 0.3]), -depth, 0.0]))
    mu = r.choice([0.1, 0.3, 0.5, 0.8])
    return Setup("between tools", case([mid] + tools, [contact(r, "dn", "lo_ymax", mu), contact(r, "up", "hi_ymin", mu)],
                 [fixed("lo"), motion], surfaces=surfaces), 4.0, swappable=False)


def press_fit(r):
    around = r.choice([16, 20, 24])
    shaft_around = r.choice([around, around, 12, 18, 28])
    shaft = {"name": "shaft", "hollow_cylinder": {"inner_radius": 0.4, "outer_radius": 1.0, "height": 1.0,
             "elements": [2, shaft_around, 3]}, "material": material(r, 1e4, large=False)}
    hub = {"name": "hub", "hollow_cylinder": {"inner_radius": 1.0, "outer_radius": r.uniform(1.4, 2.0), "height": 0.7,
           "elements": [2, around, 2]}, "material": material(r, r.choice([5e3, 1e4, 2e4]), large=False),
           "place": {"translate": [0.0, 0.1, 0.0]}}
    pair = contact(r, "hub_inner", "shaft_outer")
    pair["offset"] = [{"t": 0.5, "offset": round(r.uniform(0.001, 0.01), 5)}]
    supports = [{"set": "shaft_bottom"}]
    if r.random() < 0.5:
        supports += [{"set": "hub_top", "components": ["y"],
                      "motion": [{"t": 0.5, "u": [0.0, 0.0, 0.0]}, {"t": 1.0, "u": [0.0, 0.1, 0.0]}]}]
    return Setup("press fit", case([shaft, hub], [pair], supports), 4.0)


def loaded_block(r):
    soft, hard = pair_of_materials(r)
    gap = r.choice([0.0, 0.0, 0.03])
    block = box("block", [-0.6, gap, -0.5], [0.6, gap + 0.7, 0.5], [r.randint(2, 4), 2, r.randint(2, 4)], hard)
    modulus = min(e for law in (soft, hard) for e in [stiffness(law)])
    weight = 0.02 * modulus * 1.2
    mu = r.choice([0.3, 0.5, 0.8, 1.3])
    loads = [{"surface": "block_ymax", "force": [0.0, -weight, 0.0], "amplitude": [{"t": 0.5, "factor": 1.0}]},
             {"surface": "block_ymax", "force": [r.uniform(0.0, 0.6) * mu * weight, 0.0, 0.0],
              "amplitude": [{"t": 0.5, "factor": 0.0}, {"t": 1.0, "factor": 1.0}]}]
    return Setup("loaded block", case([slab(r, soft), block], [contact(r, "block_ymin", "slab_ymax", mu)],
                 [fixed("slab_ymin")], loads), 5.0)


def stiffness(law):
    (constants,) = law.values()
    return constants.get("youngs_modulus") or 5.0 * (constants["c10"] + constants["c01"])


def dragged_tool(r):
    soft = material(r, 10 ** r.uniform(2, 4))
    shape = r.choice(["half_ring", "ball", "cone", "torus"])
    place, outer, side = [-0.5, 0.0, 0.0], 0.6, "side"
    if shape == "half_ring":
        body, side = {"half_ring": {"inner_radius": 0.3, "outer_radius": outer, "width": 2.4, "elements": [24, 1, 1]}}, "outer"
        place[1] = outer
    elif shape == "ball":
        body, place[1] = {"ball": {"radius": outer, "elements": [4, 2, 3]}}, outer
    elif shape == "torus":
        body, place[1] = {"torus": {"radius": 0.5, "tube_radius": 0.25, "elements": [2, 2, 20]}}, 0.25
    else:
        body, side = {"cone": {"bottom_radius": 0.5, "top_radius": 0.4, "height": 0.6, "elements": [4, 2, 2]}}, "bottom"
    tool = {"name": "tool", **body, "rigid": {}, "place": {"translate": place}}
    depth = r.uniform(0.03, 0.12)
    loads, motion = [], moved("tool", (0.4, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.2, 1.0), -depth, 0.0]))
    if r.random() < 0.35:
        motion["components"] = ["x", "z", "rx", "ry", "rz"]
        motion["motion"] = [{"t": 0.4, "u": [0.0, 0.0, 0.0]}, {"t": 1.0, "u": [r.uniform(0.2, 0.8), 0.0, 0.0]}]
        force = 0.02 * stiffness(soft)
        loads = [{"surface": "tool", "force": [0.0, -force, 0.0], "amplitude": [{"t": 0.4, "factor": 1.0}]}]
    return Setup("dragged tool", case([slab(r, soft, size=(3.0, 0.8, 1.6), finer=5), tool], [contact(r, "slab_ymax", f"tool_{side}")],
                 [fixed("slab_ymin"), motion], loads), 5.0, swappable=False)


def corner(r):
    laws = [material(r, 10 ** r.uniform(2.5, 4)) for _ in range(3)]
    block = box("block", [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [r.randint(2, 4), r.randint(2, 4), 3], laws[0])
    floor = box("floor", [-0.5, -0.3, -0.2], [1.6, 0.0, 1.2], [5, 1, 4], laws[1])
    wall = box("wall", [-0.4, 0.0, -0.2], [0.0, 1.5, 1.2], [1, 5, 4], laws[2])
    contacts = [contact(r, "block_ymin", "floor_ymax"), contact(r, "block_xmin", "wall_xmax")]
    supports = [fixed("floor_ymin"), fixed("wall_xmin")]
    if r.random() < 0.5:
        depth = 0.04
        supports.append(moved("block_ymax", (1.0, [-depth, -depth, 0.0])))
        return Setup("corner", case([block, floor, wall], contacts, supports), 3.0, swappable=False)
    force = 0.03 * min(map(stiffness, laws))
    loads = [{"surface": "block_ymax", "force": [0.0, -force, 0.0]}, {"surface": "block_xmax", "force": [-force, 0.0, 0.0]}]
    return Setup("corner", case([block, floor, wall], contacts, supports, loads), 3.0, swappable=False)


def over_the_edge(r):
    soft, hard = pair_of_materials(r)
    base = box("slab", [-2.0, -0.8, -1.0], [1.0, 0.0, 1.0], [6, 2, 3], soft)
    block = box("block", [-0.6, 0.0, -0.5], [0.6, 0.6, 0.5], [r.randint(3, 5), 2, 2], hard)
    surfaces, slave = [], "block_ymin"
    if r.random() < 0.5:
        surfaces, slave = [{"name": "shoe", "of": ["block_ymin", "block_xmax", "block_xmin"]}], "shoe"
    depth = r.uniform(0.02, 0.05)
    motion = moved("block_ymax", (0.3, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.5, 0.9), -depth, 0.0]))
    return Setup("over the edge", case([base, block], [contact(r, slave, "slab_ymax")], [fixed("slab_ymin"), motion],
                 surfaces=surfaces), 5.0, swappable=False)


def pin_in_bore(r):
    clearance = r.choice([0.01, 0.02, 0.05])
    around = r.choice([16, 24])
    plate = {"name": "plate", "hollow_cylinder": {"inner_radius": 0.5, "outer_radius": 1.2, "height": 0.5,
             "elements": [2, around, 2]}, "material": material(r, 10 ** r.uniform(3, 4), large=False)}
    pin = {"name": "pin", "cone": {"bottom_radius": 0.5 - clearance, "top_radius": 0.5 - clearance, "height": 0.9,
           "elements": [r.choice([2, 4]), 2, 4]}, "material": material(r, 10 ** r.uniform(3, 5), large=False),
           "place": {"translate": [0.0, -0.2, 0.0]}}
    far = clearance + r.uniform(0.01, 0.04)
    motions = [moved(f"pin_{end}", (1.0, [far, 0.0, 0.0])) for end in ["top", "bottom"]]
    return Setup("pin in bore", case([plate, pin], [contact(r, "plate_inner", "pin_side")],
                 [fixed("plate_outer")] + motions), 3.0)


def taper(r):
    plate = {"name": "plate", "hollow_cylinder": {"inner_radius": 0.5, "outer_radius": 1.2, "height": 0.5,
             "elements": [2, r.choice([16, 24]), 2]}, "material": material(r, 10 ** r.uniform(3, 4), large=False)}
    cone = {"name": "plug", "cone": {"bottom_radius": 0.42, "top_radius": 0.56, "height": 0.9, "elements": [4, 2, 4]},
            "material": material(r, 10 ** r.uniform(3, 5), large=False), "place": {"translate": [0.0, 0.05, 0.0]}}
    supports = [fixed("plate_outer"), moved("plug_top", (1.0, [0.0, -r.uniform(0.05, 0.15), 0.0]))]
    return Setup("taper in bore", case([plate, cone], [contact(r, "plate_inner", "plug_side")], supports), 3.0)


def seal(r):
    tube = r.uniform(0.2, 0.3)
    ring = {"name": "ring", "torus": {"radius": 0.8, "tube_radius": tube, "elements": [2, 1, 14]},
            "material": material(r, 10 ** r.uniform(2, 3)), "place": {"translate": [0.0, tube, 0.0]}}
    bodies = [ring]
    for name, low in [("lo", -0.3), ("hi", 2 * tube)]:
        bodies.append(box(name, [-1.4, low, -1.4], [1.4, low + 0.3, 1.4], [5, 1, 5], material(r, 1e4, large=False)))
    depth = r.uniform(0.1, 0.3) * tube
    surfaces = [cap("dn", "ring"), cap("up", "ring", False)]
    mu = r.choice([0.1, 0.3, 0.5])
    return Setup("seal", case(bodies, [contact(r, "dn", "lo_ymax", mu), contact(r, "up", "hi_ymin", mu)],
                 [fixed("lo_ymin"), moved("hi_ymax", (1.0, [0.0, -depth, 0.0]))], surfaces=surfaces), 4.0)


def mesh(name, cells, size, divide=None):
    """An .inp file of hexahedra, wedges or tetrahedra on a set of cells of a grid."""
    numbers, elements = {}, []
    def node(i, j, k):
        return numbers.setdefault((i, j, k), len(numbers) + 1)
    for i, j, k in sorted(cells):
        c = [node(i + a, j + b, k + d) for d in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        if divide == "wedges":
            elements += [[c[0], c[1], c[2], c[4], c[5], c[6]], [c[0], c[2], c[3], c[4], c[6], c[7]]]
        elif divide == "tetrahedra":
            # six about the diagonal from 0 to 6
            around = [1, 2, 3, 7, 4, 5]
            elements += [[c[0], c[a], c[b], c[6]] for a, b in zip(around, around[1:] + around[:1])]
        else:
            elements.append(c)
    kind = {None: "C3D8", "wedges": "C3D6", "tetrahedra": "C3D4"}[divide]
    lines = ["*NODE"]
    lines += [f"{n}, {i * size[0]!r}, {j * size[1]!r}, {k * size[2]!r}" for (i, j, k), n in numbers.items()]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
    lines += [", ".join(map(str, [n + 1] + element)) for n, element in enumerate(elements)]
    return "\n".join(lines) + "\n"


def fold(r):
    """A clip whose legs are pressed together."""
    long, gap = r.randint(6, 9), r.choice([1, 2])
    height = 4 + gap
    cells = {(i, j, k) for i in range(long) for j in range(height) for k in range(2)
             if i < 2 or j < 2 or j >= height - 2}
    size = [0.25, 0.1, 0.3]
    body = {"name": "clip", "mesh": {"file": "clip.inp"}, "material": material(r, 10 ** r.uniform(2, 4), large=False)}
    inner = lambda name, up: {"name": name, "body": "clip", "normal": {"direction": [0.0, 1.0 if up else -1.0, 0.0], "degrees": 10.0}}
    total = height * size[1]
    surfaces = [{**inner("leg_lo", True), "boxes": [{"min": [0.0, 0.0, 0.0], "max": [9.0, 0.5 * total, 9.0]}]},
                {**inner("leg_hi", False), "boxes": [{"min": [0.0, 0.5 * total, 0.0], "max": [9.0, total, 9.0]}]},
                {**inner("bottom", False), "boxes": [{"min": [0.0, 0.0, 0.0], "max": [9.0, 0.0, 9.0]}]},
                {"name": "tip", "body": "clip", "normal": {"direction": [0.0, 1.0, 0.0], "degrees": 10.0},
                 "boxes": [{"min": [(long - 1) * size[0] - 0.01, total - 0.01, 0.0], "max": [9.0, total + 0.01, 9.0]}]}]
    close = gap * size[1] + r.uniform(0.0, 0.05)
    return Setup("fold", case([body], [contact(r, "leg_hi", "leg_lo")], [fixed("bottom"), moved("tip", (1.0, [0.0, -close, 0.0]))],
                 surfaces=surfaces), 0.0, meshes={"clip.inp": mesh("clip", cells, size)})


def hook(r):
    """Two hooks, pulled against each other."""
    cells = {(i, j, k) for i in range(8) for j in range(2) for k in range(2)} | \
            {(i, j, k) for i in (6, 7) for j in (2, 3) for k in range(2)}
    size = [0.2, 0.15, 0.3]
    play = r.choice([0.0, 0.02])
    left = {"name": "left", "mesh": {"file": "hook.inp"}, "material": material(r, 10 ** r.uniform(3, 4), large=False)}
    right = {"name": "right", "mesh": {"file": "hook.inp"}, "material": material(r, 10 ** r.uniform(3, 4), large=False),
             "place": {"rotate": {"axis": [0.0, 0.0, 1.0], "degrees": 180.0}, "translate": [2.4 + play, 0.95, 0.0]}}
    at = lambda name, body, direction, low, high: {"name": name, "body": body, "boxes": [{"min": low, "max": high}],
                                                   "normal": {"direction": direction, "degrees": 10.0}}
    surfaces = [at("nose_left", "left", [-1.0, 0.0, 0.0], [1.1, 0.2, -1.0], [1.3, 0.7, 2.0]),
                at("nose_right", "right", [1.0, 0.0, 0.0], [1.1, 0.2, -1.0], [1.3, 0.8, 2.0]),
                at("end_left", "left", [-1.0, 0.0, 0.0], [-0.1, -0.1, -1.0], [0.1, 0.5, 2.0]),
                at("end_right", "right", [1.0, 0.0, 0.0], [2.3, 0.3, -1.0], [2.5, 1.1, 2.0])]
    pull = play + r.uniform(0.03, 0.08)
    return Setup("hook", case([left, right], [contact(r, "nose_left", "nose_right")],
                 [fixed("end_left"), moved("end_right", (1.0, [pull, 0.0, 0.0]))], surfaces=surfaces), 0.0,
                 meshes={"hook.inp": mesh("hook", cells, size)})


def other_elements(r):
    """A block of tetrahedra, of wedges, or of second order on a slab."""
    which = r.choice(["tetrahedra", "wedges", "second order"])
    soft, hard = pair_of_materials(r)
    meshes = {}
    if which == "second order":
        radius = 0.7
        block = {"name": "block", "half_ball": {"radius": radius, "elements": [2, 1, 1]}, "order": 2, "material": hard,
                 "place": {"translate": [0.0, radius, 0.0]}}
        low, top = "block_dome", "block_flat"
        base = slab(r, soft)
        if r.random() < 0.5:
            base["order"] = 2
            base["box"]["elements"] = [4, 1, 3]
    else:
        cells = {(i, j, k) for i in range(3) for j in range(2) for k in range(3)}
        meshes = {"block.inp": mesh("block", cells, [0.35, 0.3, 0.3], which)}
        block = {"name": "block", "mesh": {"file": "block.inp"}, "material": hard}
        block["place"] = {"translate": [-0.5, 0.0, -0.45]}
        low, top = "low", "top"
        base = slab(r, soft)
    surfaces = [] if low == "block_dome" else [cap("low", "block", degrees=10.0), cap("top", "block", False, 10.0)]
    depth = r.uniform(0.03, 0.06)
    motion = moved(top, (0.4, [0.0, -depth, 0.0]), (1.0, [r.uniform(0.0, 0.4), -depth, 0.0]))
    return Setup("other elements", case([base, block], [contact(r, low, "slab_ymax")], [fixed("slab_ymin"), motion],
                 surfaces=surfaces), 5.0 if low == "block_dome" else 5.0, meshes=meshes)


KINDS = [block_on_slab, ball_on_slab, ring_on_slab, stack, between_tools, press_fit, loaded_block, dragged_tool,
         corner, over_the_edge, pin_in_bore, taper, seal, fold, hook, other_elements]
