"""Forty small design problems. Lengths are of the order of 1, moduli of 1000; each run takes seconds."""

import itertools

ITERATIONS = 40


def elastic(law="linear_elastic", e=1000.0, nu=0.3):
    return {law: {"youngs_modulus": e, "poisson_ratio": nu}}


def box(name, low, high, elements, law="linear_elastic", e=1000.0, **more):
    return {"name": name, "box": {"min": low, "max": high, "elements": elements}, "material": elastic(law, e), **more}


def beam(law="linear_elastic", elements=(12, 4, 2), **more):
    return box("beam", [0, 0, 0], [6, 2, 1], list(elements), law, **more)


def design(body="beam", vf=0.4, filtered=0.8, **more):
    out = {"bodies": [body], **more}
    if vf is not None:
        out["volume_fraction"] = vf
    if filtered is not None:
        out["density_filter"] = {"radius": filtered}
    return out


def quantity(name, **kind):
    return {"name": name, **kind}


def atmost(name, value, **more):
    return {"quantity": name, "max": value, **more}


def atleast(name, value, **more):
    return {"quantity": name, "min": value, **more}


def case(bodies, supports, loads=(), steps=1, iterations=ITERATIONS, optimizer=None, **more):
    out = {"body": bodies, "dirichlet": [{"set": s} if isinstance(s, str) else s for s in supports]}
    if loads:
        out["load"] = list(loads)
    out["load_path"] = {"steps": steps}
    out.update(more)
    out.setdefault("objective", {"compliance": {}})
    out["optimizer"] = {"iterations": iterations, **(optimizer or {})}
    out["output"] = {"every": 1000}
    return out


def force(surface, f, **more):
    return {"surface": surface, "force": f, **more}


def moved(name, u, components=None, t=1):
    table = {"set": name, "motion": [{"t": t, "u": u}]}
    if components:
        table["components"] = components
    return table


CONTINUATION = {"schedule": {"sharpness": [[0, 1], [12, 2], [20, 4], [28, 8]]}}
JUMP = {"schedule": {"sharpness": [[0, 1], [25, 8]]}}
LATE_JUMP = {"schedule": {"sharpness": [[0, 1], [34, 16]]}}
SOFT = {"sharpness": 1.0}
VOLUME = quantity("vol", volume={"body": "beam"})
TIP = quantity("tip", displacement={"set": "beam_xmax", "component": "y"})
STRESS = quantity("stress", stress={"body": "beam"})
LIGHT = {"minimise": {"quantity": "vol"}}
DOWN = force("beam_xmax", [0, -1, 0])


def tetrahedra(counts, size):
    """A box of tetrahedra, six to a cell, as an Abaqus deck."""
    nx, ny, nz = counts
    number = lambda i, j, k: 1 + i + (nx + 1) * (j + (ny + 1) * k)
    lines = ["*NODE"]
    for k, j, i in itertools.product(range(nz + 1), range(ny + 1), range(nx + 1)):
        lines.append(f"{number(i, j, k)}, {i * size}, {j * size}, {k * size}")
    lines.append("*ELEMENT, TYPE=C3D4, ELSET=all")
    count = 0
    for k, j, i in itertools.product(range(nz), range(ny), range(nx)):
        for order in itertools.permutations(range(3)):
            at, nodes = [i, j, k], []
            nodes.append(number(*at))
            for axis in order:
                at[axis] += 1
                nodes.append(number(*at))
            even = order in [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
            if not even:
                nodes[2], nodes[3] = nodes[3], nodes[2]
            count += 1
            lines.append(f"{count}, " + ", ".join(map(str, nodes)))
    return "\n".join(lines) + "\n"


TETS = {"beam.inp": tetrahedra((12, 4, 2), 0.5)}
TET_BEAM = {"name": "beam", "mesh": {"file": "beam.inp"}, "material": elastic()}
TET_FACES = [
    {"name": "beam_xmin", "body": "beam", "normal": {"direction": [-1, 0, 0]}},
    {"name": "beam_xmax", "body": "beam", "normal": {"direction": [1, 0, 0]}},
]


# compliance

def cantilever():
    return case([beam()], ["beam_xmin"], [DOWN], design=design())


def cantilever_large():
    return case([beam("neo_hooke")], ["beam_xmin"], [force("beam_xmax", [0, -6, 0])], steps=2, design=design())


def cantilever_sensitivity():
    return case([beam()], ["beam_xmin"], [DOWN], design=design(filtered=None, sensitivity_filter={"radius": 0.8}))


def cantilever_projected():
    return case([beam()], ["beam_xmin"], [DOWN], design=design(projection={}))


def feet():
    return {"name": "feet", "within": "beam_ymin",
            "boxes": [{"min": [0, 0, 0], "max": [0.5, 0, 1]}, {"min": [5.5, 0, 0], "max": [6, 0, 1]}]}


def bridge():
    loads = [{"surface": "beam_ymax", "pressure": 1.0}]
    passive = [{"surface": "beam_ymax", "within": 0.3}]
    return case([beam()], ["feet"], loads, set=[feet()], optimizer=CONTINUATION,
                design=design(vf=0.45, projection={"sharpness": 1.0}, passive_solid=passive))


def cantilever_tetrahedra():
    return case([TET_BEAM], ["beam_xmin"], [DOWN], surface=TET_FACES, design=design()), TETS


def two_loads(combination):
    loads = [force("beam_xmax", [0, -1, 0], load_case="down"), force("beam_xmax", [0.0, 0, 2], load_case="aside")]
    return case([beam(elements=(12, 4, 3))], ["beam_xmin"], loads, load_case=[{"name": "down"}, {"name": "aside"}],
                design=design(), objective={"compliance": {}, "load_cases": combination})


def thick():
    return case([beam()], ["beam_xmin"], [DOWN], optimizer=CONTINUATION,
                design=design(filtered=None, minimum_thickness=0.9, projection={"sharpness": 1.0}))


def prescribed_volume():
    return case([beam()], ["beam_xmin"], [DOWN], design=design(vf=None, initial=0.4), quantity=[VOLUME],
                constraint=[{"quantity": "vol", "min": 4.8, "max": 4.8}])


def symmetric_twisted():
    corner = [{"name": "corner", "body": "beam", "within": "beam_xmax", "boxes": [{"min": [6, 1, 0], "max": [6, 2, 1]}]}]
    return case([beam(elements=(12, 4, 4))], ["beam_xmin"], [force("corner", [0, -1, 0.5])], surface=corner,
                design=design(vf=0.3, symmetry=[{"normal": "z", "at": 0.5}]))


def printed():
    return case([beam()], ["beam_xmin"], [DOWN], design=design(vf=0.5, overhang={"direction": "y"}))


# least volume

def light(constraints, quantities, optimizer=None, initial=0.6, **more):
    return case([beam()], ["beam_xmin"], [DOWN], design=design(vf=None, initial=initial, **more), optimizer=optimizer,
                quantity=[VOLUME, *quantities], constraint=constraints, objective=LIGHT)


def light_displacement(**more):
    return light([atleast("tip", -0.3)], [TIP], **more)


def light_stress():
    return light([atmost("stress", 25.0)], [STRESS])


def light_both(**more):
    return light([atleast("tip", -0.35), atmost("stress", 35.0)], [TIP, STRESS], **more)


def light_cases():
    loads = [force("beam_xmax", [0, -1, 0], load_case="down"), force("beam_xmax", [0, 0, 0.5], load_case="aside")]
    return case([beam(elements=(12, 4, 3))], ["beam_xmin"], loads, load_case=[{"name": "down"}, {"name": "aside"}],
                design=design(vf=None, initial=0.7), objective=LIGHT,
                quantity=[VOLUME, quantity("bend", displacement={"set": "beam_xmax", "component": "norm"})],
                constraint=[atmost("bend", 0.35)])


def light_tetrahedra():
    return case([TET_BEAM], ["beam_xmin"], [DOWN], surface=TET_FACES, design=design(vf=None, initial=0.6),
                quantity=[VOLUME, TIP], constraint=[atleast("tip", -0.2)], objective=LIGHT), TETS


def stiff_stress():
    return case([beam()], ["beam_xmin"], [DOWN], design=design(vf=0.5), quantity=[STRESS],
                constraint=[atmost("stress", 26.0)])


def corner_bracket(optimizer=None, **more):
    body = box("beam", [0, 0, 0], [4, 4, 0.5], [12, 12, 1])
    tip = [{"name": "tip_face", "body": "beam", "within": "beam_xmax", "boxes": [{"min": [4, 0.9, 0], "max": [4, 1.7, 0.5]}]}]
    top = [{"name": "top", "within": "beam_ymax", "boxes": [{"min": [0, 4, 0], "max": [1.7, 4, 0.5]}]}]
    return case([body], ["top"], [force("tip_face", [0, -0.5, 0])], surface=tip, set=top,
                optimizer=optimizer,
                design=design(vf=None, initial=0.7, filtered=0.6, **more,
                              passive_void=[{"min": [1.67, 1.67, -1], "max": [5, 5, 1]}]),
                quantity=[VOLUME, STRESS], constraint=[atmost("stress", 20.0)], objective=LIGHT)


# mechanisms

def inverter(bound=None, optimizer=None, law="linear_elastic", push=1.0, **more):
    body = box("beam", [0, 0, 0], [4, 2, 0.5], [16, 8, 1], law)
    spring = [box("inner", [-0.5, 0, 0], [0, 0.5, 0.5], [1, 1, 1], e=10.0), box("outer", [4, 0, 0], [4.5, 0.5, 0.5], [1, 1, 1], e=5.0)]
    ties = [{"slave": "inner_xmax", "master": "beam_xmin", "tied": True}, {"slave": "outer_xmin", "master": "beam_xmax", "tied": True}]
    sets = [{"name": "corner", "within": "beam_xmin", "boxes": [{"min": [0, 1.5, 0], "max": [0, 2, 0.5]}]}]
    surfaces = [{"name": "push", "body": "beam", "within": "beam_xmin", "boxes": [{"min": [0, 0, 0], "max": [0, 0.5, 0.5]}]},
                {"name": "out", "body": "beam", "within": "beam_xmax", "boxes": [{"min": [4, 0, 0], "max": [4, 0.5, 0.5]}]}]
    quantities = [quantity("u", displacement={"set": "out", "component": "x"}), quantity("stroke", displacement={"set": "push", "component": "x"})]
    out = case([body, *spring], ["corner", "inner_xmin", "outer_xmax"], [force("push", [push, 0, 0])], contact=ties,
               set=sets, surface=surfaces, symmetry=[{"normal": "y"}, {"normal": "z"}], optimizer=optimizer,
               design=design(vf=0.3, filtered=0.4, **more), quantity=quantities, objective={"minimise": {"quantity": "u"}})
    if bound:
        out["constraint"] = [atmost("stroke", bound)]
    return out


def gripper(stress=None, optimizer=None, **more):
    body = box("beam", [0, 0.5, 0], [4, 2, 0.5], [16, 6, 1], "neo_hooke")
    part = box("part", [3.25, 0.0, 0], [4, 0.49, 0.5], [3, 2, 1], "neo_hooke", e=500.0)
    surfaces = [{"name": "push", "body": "beam", "within": "beam_xmin", "boxes": [{"min": [0, 0.5, 0], "max": [0, 1.0, 0.5]}]},
                {"name": "jaw", "body": "beam", "within": "beam_ymin", "boxes": [{"min": [3, 0.5, 0], "max": [4, 0.5, 0.5]}]}]
    sets = [{"name": "hinge", "within": "beam_xmin", "boxes": [{"min": [0, 1.5, 0], "max": [0, 2, 0.5]}]}]
    out = case([body, part], ["hinge", "part_ymin", moved("push", [-0.1, 0, 0])], surface=surfaces, set=sets, steps=2,
                contact=[{"slave": "part_ymax", "master": "jaw", "friction": 0.2}], symmetry=[{"normal": "z"}],
                optimizer=optimizer,
                design=design(vf=0.35, filtered=0.4, initial=0.5, energy_interpolation={}, **more,
                              passive_solid=[{"surface": "jaw", "within": 0.3}]),
                quantity=[quantity("grip", contact_force={"slave": "part_ymax", "component": "normal"})],
                objective={"maximise": {"quantity": "grip"}})
    if stress:
        out["quantity"].append(STRESS)
        out["constraint"] = [atmost("stress", stress)]
    return out


def snap():
    """A pin slides along an arm; the force that it takes shall follow a curve."""
    arm = box("beam", [0, 0, 0], [8, 1, 0.5], [24, 4, 1], "neo_hooke")
    pin = {"name": "pin", "cone": {"height": 1.0, "bottom_radius": 0.6, "top_radius": 0.6, "elements": [4, 3, 1]}, "rigid": {},
           "place": {"rotate": {"axis": [1, 0, 0], "degrees": 90}, "translate": [6.0, 1.6, -0.25]}}
    motion = [{"t": 0.4, "u": [0, -0.2, 0], "angle": 0}, {"t": 1.0, "u": [1.0, -0.4, 0], "angle": 0}]
    return case([arm, pin], ["beam_xmin", {"set": "pin", "motion": motion}], steps=10,
                contact=[{"slave": "beam_ymax", "master": "pin_side", "friction": 0.2}],
                design=design(vf=0.5, filtered=0.6, initial=0.7, energy_interpolation={},
                              passive_solid=[{"surface": "beam_ymax", "within": 0.25}]),
                quantity=[quantity("press", reaction={"set": "pin", "component": "y"})],
                objective={"follow": {"quantity": "press", "points": [[0.4, -0.12], [0.7, -0.12], [1.0, -0.12]]}})


def spring_curve():
    quantities = [quantity("pull", reaction={"set": "beam_xmax", "component": "y"})]
    return case([beam("neo_hooke")], ["beam_xmin", moved("beam_xmax", [0, 0.6, 0])], steps=3, quantity=quantities,
                design=design(vf=0.6, initial=0.6),
                objective={"follow": {"quantity": "pull", "points": [[0.33, 0.8], [0.67, 1.6], [1.0, 2.0]]}})


# contact

def block_on_slab(contact=None, quantities=(), constraint=(), objective=None, vf=0.4, optimizer=None, tangential=None,
                  wide=False, **more):
    width, across = (2, 4) if wide else (1, 2)
    slab = box("beam", [0, 0, 0], [6, 1.5, width], [12, 3, across], "neo_hooke")
    block = box("block", [2.25, 1.5, 0.25], [3.75, 2.25, width - 0.25], [4, 2, across], "neo_hooke")
    feet = [{"min": [0, 0, 0], "max": [1, 0, width]}, {"min": [5, 0, 0], "max": [6, 0, width]}]
    sets = [{"name": "feet", "within": "beam_ymin", "boxes": feet}]
    pair = {"slave": "block_ymin", "master": "beam_ymax", "friction": 0.3, **(contact or {})}
    supports, loads = ["feet", {"set": "block_ymax", "components": ["x", "z"]}], [{"surface": "block_ymax", "pressure": 10.0}]
    if tangential:
        supports = ["feet", {"set": "block_ymax", "motion": [{"t": 0.5, "u": [0, -0.05, 0]}, {"t": 1, "u": [tangential, -0.05, 0]}]}]
        loads = []
    chosen = design(vf=vf, filtered=0.75, passive_solid=[{"surface": "beam_ymax", "within": 0.3}])
    chosen.update(more)
    out = case([slab, block], supports, loads, steps=3 if not tangential else 4, set=sets, contact=[pair], design=chosen, optimizer=optimizer)
    if quantities:
        out["quantity"] = list(quantities)
    if constraint:
        out["constraint"] = list(constraint)
    if objective:
        out["objective"] = objective
    return out


def bare_slab():
    out = block_on_slab(wide=True)
    out["load"][0]["pressure"] = 30.0
    del out["design"]["passive_solid"], out["design"]["density_filter"]
    out["design"]["sensitivity_filter"] = {"radius": 0.75}
    return out


def light_contact_stress():
    quantities = [VOLUME, quantity("uy", displacement={"set": "block_ymax", "component": "y"}), STRESS]
    out = block_on_slab(quantities=quantities, constraint=[atleast("uy", -0.35), atmost("stress", 400.0)], objective=LIGHT,
                        vf=None, initial=0.6, wide=True)
    out["load"][0]["pressure"] = 30.0
    del out["design"]["passive_solid"]
    return out


def peak_pressure():
    quantities = [quantity("peak", contact_pressure={"slave": "block_ymin", "measure": "peak"}), quantity("c", compliance={})]
    return block_on_slab(quantities=quantities, objective={"minimise": {"quantity": "peak"}}, constraint=[atmost("c", 0.6)], vf=0.6)


def damper():
    quantities = [quantity("heat", friction_work={"slave": "block_ymin"}), STRESS]
    return block_on_slab(quantities=quantities, objective={"maximise": {"quantity": "heat"}}, tangential=0.3,
                         constraint=[atmost("stress", 45.0)], vf=0.5)


def uncertain(combination):
    out = block_on_slab(tangential=0.1, quantities=[quantity("press", contact_force={"slave": "block_ymin", "component": "normal"})],
                        objective={"maximise": {"quantity": "press"}, "load_cases": combination})
    out["load_case"] = [{"name": "left", "bodies": [{"body": "block", "offset": [-0.5, 0, 0]}]},
                        {"name": "middle"}, {"name": "right", "bodies": [{"body": "block", "offset": [0.5, 0, 0]}], "friction": 0.6}]
    return out


# press fits: a quarter of a hub on a pin

def fit(constraint, quantities, objective, vf=None, turning=None, optimizer=None, **more):
    hub = {"name": "hub", "hollow_cylinder": {"inner_radius": 1.0, "outer_radius": 2.0, "height": 0.5, "elements": [4, 24, 1]},
           "material": elastic("neo_hooke")}
    pin = {"name": "pin", "hollow_cylinder": {"inner_radius": 0.5, "outer_radius": 1.0, "height": 0.5, "elements": [2, 24, 1]},
           "material": elastic("neo_hooke", 3000.0)}
    contact = [{"slave": "pin_outer", "master": "hub_inner", "friction": 0.2, "offset": [{"t": 0.5, "offset": 0.01}]}]
    supports = ["pin_inner", "hub_outer"]
    if turning:
        supports[0] = {"set": "pin_inner", "motion": [{"t": 0.5, "u": [0, 0, 0]}, {"t": 1, "angle": turning}],
                       "rotation": {"point": [0, 0, 0], "direction": [0, 1, 0]}}
    chosen = {"bodies": ["hub"], "density_filter": {"radius": 0.5}, "passive_solid": [{"surface": "hub_inner", "within": 0.15}], **more}
    if vf:
        chosen["volume_fraction"] = vf
    return case([hub, pin], supports, contact=contact, steps=2 if turning else 1, design=chosen, quantity=quantities,
                constraint=constraint, objective=objective, optimizer=optimizer)


HUB_VOLUME = quantity("vol", volume={"body": "hub"})
TORQUE = quantity("torque", moment={"set": "pin_inner", "point": [0, 0, 0], "direction": [0, 1, 0]})
PRESSURE = quantity("low", contact_pressure={"slave": "pin_outer", "measure": "minimum"})


def fit_torque(optimizer=None, **more):
    return fit([atleast("torque", 1.5)], [HUB_VOLUME, TORQUE], LIGHT, turning=2.0, initial=0.8, optimizer=optimizer, **more)


def fit_pressure():
    return fit([atleast("low", 2.0)], [HUB_VOLUME, PRESSURE], LIGHT, initial=0.8)


def fit_most_torque():
    stress = quantity("stress", stress={"body": "hub"})
    return fit([atmost("stress", 15.0)], [TORQUE, stress], {"maximise": {"quantity": "torque"}}, turning=2.0, vf=0.6)


def gasket():
    strip = box("gasket", [0, 0, 0], [30, 3, 4], [12, 2, 2], "neo_hooke", e=6.0)
    cover = box("beam", [0, 3, 0], [36, 11, 8], [12, 3, 3], "neo_hooke", e=20000.0)
    bolt = [{"name": "bolt", "body": "beam", "boxes": [{"min": [29.9, 10.9, -1], "max": [37, 11.1, 9]}]}]
    return case([strip, cover], ["gasket_ymin"], [force("bolt", [0, -150.0, 0])], surface=bolt, steps=2,
                symmetry=[{"normal": "x"}, {"normal": "z"}], contact=[{"slave": "gasket_ymax", "master": "beam_ymin", "friction": 0.3}],
                quantity=[quantity("low", contact_pressure={"slave": "gasket_ymax", "measure": "minimum"}), VOLUME],
                constraint=[atleast("low", 0.45)], objective=LIGHT,
                optimizer={"schedule": {"sharpness": [[0, 2], [16, 4], [26, 8]]}},
                design=design(vf=None, initial=0.9, filtered=5.0, projection={"sharpness": 2.0},
                              passive_solid=[{"surface": "bolt", "within": 2.0}, {"surface": "beam_ymin", "within": 2.0}]))


PROBLEMS = {
    "cantilever": cantilever,
    "cantilever, large rotations": cantilever_large,
    "cantilever, sensitivity filter": cantilever_sensitivity,
    "cantilever, projection": cantilever_projected,
    "cantilever, tetrahedra": cantilever_tetrahedra,
    "cantilever, printable": printed,
    "cantilever, prescribed volume": prescribed_volume,
    "cantilever, minimum thickness": thick,
    "bridge, continuation": bridge,
    "twisted beam, symmetric": symmetric_twisted,
    "two load cases, worst": lambda: two_loads("worst"),
    "least volume, displacement": light_displacement,
    "least volume, displacement, light start": lambda: light_displacement(initial=0.15),
    "least volume, displacement, solid start": lambda: light_displacement(initial=1.0, projection=SOFT, optimizer=CONTINUATION),
    "least volume, displacement, one jump of sharpness": lambda: light_displacement(projection=SOFT, optimizer=JUMP),
    "least volume, displacement, late jump": lambda: light_displacement(projection=SOFT, optimizer=LATE_JUMP),
    "least volume, stress": light_stress,
    "least volume, displacement and stress": light_both,
    "least volume, displacement and stress, GCMMA": lambda: light_both(optimizer={"method": "gcmma"}),
    "least volume, two load cases": light_cases,
    "least volume, tetrahedra": light_tetrahedra,
    "bracket with a corner, stress": corner_bracket,
    "bracket with a corner, continuation": lambda: corner_bracket(CONTINUATION, projection=SOFT),
    "compliance, stress": stiff_stress,
    "inverter": inverter,
    "inverter, stroke": lambda: inverter(bound=0.05),
    "inverter, large rotations, continuation":
        lambda: inverter(None, CONTINUATION, "neo_hooke", 5.0, projection=SOFT, energy_interpolation={}),
    "gripper": gripper,
    "gripper, stress": lambda: gripper(60.0, CONTINUATION, projection=SOFT),
    "spring with a curve": spring_curve,
    "pin along an arm": snap,
    "block on slab, no solid skin": bare_slab,
    "least volume under a block, stress": light_contact_stress,
    "peak pressure": peak_pressure,
    "damper": damper,
    "uncertain starts": lambda: uncertain({"mean_plus_deviations": 1.0}),
    "press fit, torque, late jump": lambda: fit_torque(LATE_JUMP, projection=SOFT),
    "press fit, most torque, stress": fit_most_torque,
    "press fit, least pressure": fit_pressure,
    "gasket, least pressure": gasket,
}
