#include "scenes/detail/schema.h"

#include "scenes/scene.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace limber::scenes {

namespace {

constexpr double huge = 1e9;  // a larger number than this is a slip in any unit used here

constexpr Interval any{-huge, huge};
constexpr Interval at_least_zero{0, huge};
constexpr Interval positive{0, huge, true};
constexpr Interval share{0, 1};

constexpr Interval from_to(double lower, double upper) { return {lower, upper}; }

// The scene file, from top to bottom.
constexpr Key all_keys[] = {
    {"name", Type::name, {}, 0, required, "what the scene is called", "", ""},
    {"description", Type::text, {}, 0, "\"\"", "one line that `limber scenes` shows", "", ""},

    {"world", Type::table, {}, 0, required, "the space in which all happens", "", ""},
    {"world.bounds_m", Type::box, any, 0, required, "m; lower and upper corner", "", ""},
    {"world.walls", Type::boolean, {}, 0, "true", "the bounds are closed by rigid walls", "", ""},
    {"world.gravity_m_s2", Type::vector, from_to(-1000, 1000), 3, "[0, 0, 0]", "m/s²", "", ""},
    {"world.rest_speed_m_s", Type::number, from_to(0, 1000), 0, "0.001",
     "m/s; a soft body all of whose nodes are slower, and would gain less in a second, comes to a stand and "
     "costs nothing "
     "until it is touched; 0: only where nothing would move",
     "", ""},
    {"world.contact_offset_m",
     Type::number,
     {0, 1},
     0,
     may_lack,
     "m; fine surfaces that near push each other; else 0.5 % of the longest edge of the robot's box, or the "
     "gap of two "
     "bodies at the start where that is less",
     "",
     ""},
    {"world.part_overlaps",
     Type::boolean,
     {},
     0,
     "true",
     "fine surfaces that overlap by more than contact_offset_m at the start are parted before the plan "
     "begins "
     "(docs/contact.md); false: such a scene is refused",
     "",
     ""},
    {"world.max_dt_s",
     Type::number,
     {0, 1, true},
     0,
     may_lack,
     "s; lowers the time step that is otherwise found from the bodies; it never raises it",
     "",
     ""},

    {"bodies",
     Type::tables,
     {},
     0,
     required,
     "one `[[bodies]]` for each thing; exactly one is the robot, or, where there is no goal, at most one",
     "",
     ""},
    {"bodies[].name",
     Type::name,
     {},
     0,
     required,
     "names its folder and `--set bodies.NAME.key=value`",
     "",
     ""},
    {"bodies[].role",
     Type::choice,
     {},
     0,
     required,
     "the robot is moved by forces, obstacles and free bodies only by contact and gravity; scenery is seen "
     "and takes no part",
     "robot, obstacle, free, scenery",
     ""},
    {"bodies[].kind",
     Type::choice,
     {},
     0,
     "\"deformable\"",
     "a rigid obstacle does not move; a rigid robot or free body moves as one piece",
     "deformable, rigid",
     ""},
    {"bodies[].contact",
     Type::choice,
     {},
     0,
     may_lack,
     "where it is touched: at its fine surface, or, as in the paper, at its cage; else `\"surface\"`, and "
     "with "
     "`planner.preset = \"paper\"` `\"cage\"`",
     "surface, cage",
     ""},
    {"bodies[].deformation",
     Type::choice,
     {},
     0,
     may_lack,
     "how the fine surface follows its cage, where it is touched as in films, exports and reports: linear in "
     "each tet, or bent smoothly by Phong Deformation (docs/binding.md), which costs up to three times the "
     "planning where contact is on surfaces; else `\"phong\"`, and of what is rigid or with "
     "`planner.preset = \"paper\"` `\"linear\"`",
     "linear, phong",
     ""},
    {"bodies[].self_contact",
     Type::boolean,
     {},
     0,
     may_lack,
     "parts of a deformable body push one another apart; else wherever a body that is touched at its surface "
     "can "
     "reach itself: it fills less than nine tenths of its convex hull",
     "",
     ""},
    {"bodies[].max_volume_change",
     Type::number,
     {0, 1000, true, false},
     0,
     "0.1",
     "\\|V − V₀\\|/V₀: no plan passes through a state in which a body that moves has changed more",
     "",
     ""},
    {"bodies[].max_stretch",
     Type::number,
     {1, 1000, true, false},
     0,
     may_lack,
     "s: the body stiffens as its tets come near to being stretched to s times their length, or pressed to "
     "1/s of it, in any direction, and no plan passes through a state in which one is beyond; else 2 for a "
     "soft "
     "body that is touched at its surface, and none for others; 1000: none",
     "",
     ""},
    {"bodies[].max_contact_load_n",
     Type::number,
     {0, 1e9, true, false},
     0,
     may_lack,
     "N: no plan passes through a frame in which other bodies and walls press this one with more: the "
     "magnitudes of all forces of contact on it, summed, so that pushes from two sides add up; else no limit",
     "",
     ""},
    {"bodies[].color",
     Type::color,
     {},
     0,
     may_lack,
     "`\"#rrggbb\"`; else robot #c0392b, obstacle #3f7cac, free #e0a030, scenery #c8ccd0",
     "",
     ""},
    {"bodies[].texture",
     Type::boolean,
     {},
     0,
     may_lack,
     "shows the colors and images of its model's file (docs/import.md), where it "
     "has some, and `color` where it has none; else where no `color` is given. Not of scenery",
     "",
     ""},
    {"bodies[].opacity",
     Type::number,
     {0, 1, true, false},
     0,
     "1.0",
     "below 1 it is seen through: of a thin sheet seen face on, denser where it slants; its shadow on "
     "the ground is as faint, and below 0.5 it casts none on bodies",
     "",
     ""},
    {"bodies[].look",
     Type::choice,
     {},
     0,
     may_lack,
     "what its surface is of: how rough, with what fine relief, and how much light shines through what is "
     "thin; else rubber where it is deformable, and plain",
     "plain, rubber, tissue, bone, fabric, skin",
     ""},
    {"bodies[].roughness", Type::number, from_to(0.05, 1), 0, may_lack,
     "of its surface: 0.05 like glass, 1 like chalk; else by its look: plain 0.45, rubber 0.5, tissue 0.32, "
     "bone 0.65, fabric 0.9, skin 0.55",
     "", ""},
    {"bodies[].triangles", Type::integer, from_to(100, 10'000'000), 0, may_lack,
     "scenery: its surface is simplified to about so many, for film; transparent surfaces cost by the "
     "triangle",
     "", ""},
    {"bodies[].metallic", Type::number, share, 0, "0.0", "1: reflects in its own colour and scatters nothing",
     "", ""},

    {"bodies[].model",
     Type::table,
     {},
     0,
     required,
     "what is seen: exactly one of file, made, box, plate, blocks, sphere, tube",
     "",
     ""},
    {"bodies[].model.file",
     Type::text,
     {},
     0,
     may_lack,
     "a model file, looked for beside the scene and in the cache of models",
     "",
     ""},
    {"bodies[].model.made",
     Type::choice,
     {},
     0,
     may_lack,
     "a model that limber makes; beside `file`: used where the file cannot be had",
     "beach_ball, bunny, dragon, heart, lung_left, lung_right, liver, spine, ribcage",
     ""},
    {"bodies[].model.scale", Type::number, positive, 0, may_lack,
     "m a file unit; with file; 1 when not given", "", ""},
    {"bodies[].model.height_m", Type::number, positive, 0, may_lack,
     "m; with file (instead of scale) or made: the model is scaled to be this high; made alone: 1 when not "
     "given",
     "", ""},
    {"bodies[].model.up",
     Type::choice,
     {},
     0,
     may_lack,
     "with file: its axis that points up; +z when not given",
     "+x, -x, +y, -y, +z, -z",
     ""},
    {"bodies[].model.front",
     Type::choice,
     {},
     0,
     may_lack,
     "with file: its axis that is turned to our +x; +x when not given",
     "+x, -x, +y, -y, +z, -z",
     ""},
    {"bodies[].model.box", Type::table, {}, 0, may_lack, "a box", "", ""},
    {"bodies[].model.box.size_m", Type::vector, positive, 3, required, "m; along x, y, z", "", ""},
    {"bodies[].model.box.bevel_m", Type::number, at_least_zero, 0, "0.0",
     "m; radius of the rounded edges, at most half the smallest size", "", ""},
    {"bodies[].model.box.triangle_m", Type::number, positive, 0, may_lack,
     "m; longest edge of a triangle on a flat face; a 32nd of the largest size when not given", "", ""},
    {"bodies[].model.plate",
     Type::table,
     {},
     0,
     may_lack,
     "a box with a hole along its thinnest axis",
     "",
     ""},
    {"bodies[].model.plate.size_m", Type::vector, positive, 3, required, "m; along x, y, z", "", ""},
    {"bodies[].model.plate.bevel_m", Type::number, at_least_zero, 0, "0.0",
     "m; radius of the rounded edges, also of the hole's", "", ""},
    {"bodies[].model.plate.triangle_m", Type::number, positive, 0, may_lack, "m; as of a box", "", ""},
    {"bodies[].model.plate.hole", Type::table, {}, 0, may_lack, "the hole; none when not given", "", ""},
    {"bodies[].model.plate.hole.shape", Type::choice, {}, 0, "\"round\"", "", "round, square", ""},
    {"bodies[].model.plate.hole.size_m", Type::number, positive, 0, required,
     "m; diameter, or side of the square", "", ""},
    {"bodies[].model.plate.hole.center_m", Type::vector, any, 2, "[0, 0]",
     "m; from the plate's middle, along its two longer axes in the order x, y, z", "", ""},
    {"bodies[].model.blocks",
     Type::table,
     {},
     0,
     may_lack,
     "boxes with boxes cut out, in coordinates of their own",
     "",
     ""},
    {"bodies[].model.blocks.solids", Type::boxes, any, 0, required, "m; they hang together by faces", "", ""},
    {"bodies[].model.blocks.holes", Type::boxes, any, 0, "[]", "m; cut out of all solids", "", ""},
    {"bodies[].model.blocks.bevel_m", Type::number, at_least_zero, 0, "0.0",
     "m; radius of the rounded edges, at most half of the least way between two faces", "", ""},
    {"bodies[].model.blocks.triangle_m", Type::number, positive, 0, may_lack, "m; as of a box", "", ""},
    {"bodies[].model.tube",
     Type::table,
     {},
     0,
     may_lack,
     "a tube, or a rod, along a smooth curve, in coordinates of its own",
     "",
     ""},
    {"bodies[].model.tube.path_m", Type::points, any, 0, required,
     "m; its middle line goes through them; a rod whose last point is its first is a ring", "", ""},
    {"bodies[].model.tube.diameter_m", Type::number, positive, 0, required, "m; outer", "", ""},
    {"bodies[].model.tube.wall_m", Type::number, at_least_zero, 0, "0.0",
     "m; 0: a rod, with half a ball at each end", "", ""},
    {"bodies[].model.tube.triangle_m", Type::number, positive, 0, may_lack,
     "m; longest edge of a triangle, about; an eighth of the diameter when not given", "", ""},
    {"bodies[].model.sphere", Type::table, {}, 0, may_lack, "a sphere", "", ""},
    {"bodies[].model.sphere.diameter_m", Type::number, positive, 0, required, "m", "", ""},
    {"bodies[].model.sphere.triangle_m", Type::number, positive, 0, may_lack,
     "m; longest edge of a triangle; a 32nd of the diameter when not given", "", ""},

    {"bodies[].cage",
     Type::table,
     {},
     0,
     may_lack,
     "the coarse tets that are simulated: one of tets, cells and cell_m",
     "",
     ""},
    {"bodies[].cage.tets", Type::integer, from_to(24, 200'000), 0, may_lack,
     "budget of a cage made round the model", "", ""},
    {"bodies[].cage.cells", Type::integers, from_to(1, 200), 3, may_lack,
     "five tets each; boxes, and plates without a hole: along x, y, z; tubes: round (even, 6 at least), "
     "through the wall, along; rods: across, across (the same), along (even, 6 at least, of a ring)",
     "", ""},
    {"bodies[].cage.cell_m", Type::number, positive, 0, may_lack,
     "m; blocks: cells between their faces, five tets each, no longer than this, two at least through a "
     "solid",
     "", ""},
    {"bodies[].cage.mode",
     Type::choice,
     {},
     0,
     "\"lattice\"",
     "with tets: how the cage is made (docs/cage.md)",
     "lattice, fast, paper, conform",
     ""},
    {"bodies[].cage.shells", Type::integer, from_to(0, 1000), 0, "0",
     "at most so many convex shells (docs/decomposition.md), for hulls of exports and parts that name them; "
     "no motion hangs on them. 0: none, but 32 where a part names one, and in mode paper, which makes the "
     "cage of them, one for each 75 tets, at most 32",
     "", ""},

    {"bodies[].material", Type::table, {}, 0, may_lack, "required, except for rigid obstacles", "", ""},
    {"bodies[].material.model",
     Type::choice,
     {},
     0,
     "\"springs\"",
     "springs: the paper's, along edges and of volumes; neo_hookean: the moduli of a table "
     "(docs/dynamics.md)",
     "springs, neo_hookean",
     ""},
    {"bodies[].material.youngs_modulus_pa", Type::number, from_to(1e-3, 1e12), 0, may_lack,
     "Pa; stiffness; required for deformable bodies", "", ""},
    {"bodies[].material.poisson_ratio", Type::number, from_to(0, 0.495), 0, "0.45",
     "near 0.5: keeps its volume; springs have at least 0.25", "", ""},
    {"bodies[].material.density_kg_m3", Type::number, from_to(1e-6, 1e5), 0, required,
     "kg/m³; of the model, not of its cage", "", ""},
    {"bodies[].material.damping_ratio", Type::number, share, 0, "0.05",
     "share of the critical damping of the body's slowest stretching", "", ""},
    {"bodies[].material.mass_damping_per_s", Type::number, from_to(0, 1000), 0, "0.0",
     "1/s; what moves is slowed by so much of its velocity, as in a medium at rest: swings die away", "", ""},
    {"bodies[].material.fascia_hz", Type::number, from_to(0, 30), 0, "0.0",
     "Hz; what holds the body in its place: each node is drawn to its place in the scene, as if by a spring "
     "of its own "
     "that would swing so often; 0: nothing does (docs/dynamics.md, \"Fascia\")",
     "", ""},
    {"bodies[].material.fascia_damping_ratio", Type::number, from_to(0, 2), 0, "1.0",
     "share of the critical damping of these springs", "", ""},
    {"bodies[].material.friction", Type::number, from_to(0, 2), 0, "0.2",
     "Coulomb's; a pair of bodies has the geometric mean", "", ""},
    {"bodies[].material.mesh_independent",
     Type::boolean,
     {},
     0,
     "true",
     "coarse tets are too stiff: their stiffness is lowered until the whole body gives way as its material "
     "would",
     "",
     ""},
    {"bodies[].parts",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[bodies.parts]]` for each part that is stiffer, softer, heavier or lighter than the material "
     "says; a later "
     "one rules where two meet",
     "",
     ""},
    {"bodies[].parts[].shell", Type::integer, from_to(0, 999), 0, may_lack,
     "the tets of this convex shell, as `limber info` numbers them; or box_m", "", ""},
    {"bodies[].parts[].box_m", Type::region, any, 0, may_lack,
     "m; the tets with their middle in this box, in world coordinates at the start", "", ""},
    {"bodies[].parts[].youngs_modulus_pa", Type::number, from_to(1e-3, 1e12), 0, may_lack,
     "Pa; instead of the material's; not of rigid bodies", "", ""},
    {"bodies[].parts[].density_kg_m3", Type::number, from_to(1e-6, 1e5), 0, may_lack,
     "kg/m³; instead of the material's", "", ""},

    {"bodies[].pose", Type::table, {}, 0, "{}", "where the body is at the start", "", ""},
    {"bodies[].pose.position_m", Type::vector, any, 3, "[0, 0, 0]", "m; where the anchor goes", "", ""},
    {"bodies[].pose.anchor",
     Type::choice,
     {},
     0,
     "\"origin\"",
     "the model's own origin (made models: their middle), the middle of its bounding box, or the middle of "
     "the lower "
     "face of that box",
     "origin, center, bottom",
     ""},
    {"bodies[].pose.axis", Type::vector, any, 3, "[0, 0, 1]", "of the turn, of any length but 0", "", ""},
    {"bodies[].pose.angle_deg", Type::number, from_to(-360, 360), 0, "0.0",
     "degrees; turn about that axis through the model's origin", "", ""},

    {"bodies[].velocity_m_s", Type::vector, any, 3, "[0, 0, 0]",
     "m/s; at the start, of a body that forces can push; held nodes stand", "", ""},
    {"bodies[].angular_velocity_rad_s", Type::vector, any, 3, "[0, 0, 0]",
     "rad/s; at the start, about its centre of mass", "", ""},
    {"bodies[].gravity_m_s2", Type::vector, from_to(-1000, 1000), 3, may_lack,
     "m/s²; of a body that forces can push; left out: the world's", "", ""},

    {"bodies[].fixed",
     Type::fixed,
     {},
     0,
     "[]",
     "cage nodes that are held: `\"walls\"` (those on a wall of the bounds), or a list of `\"walls\"` and "
     "boxes "
     "`{ box_m = [[…], […]] }`",
     "",
     ""},
    {"bodies[].fixed[].box_m", Type::region, any, 0, required,
     "m; in world coordinates; holds all nodes inside it", "", ""},

    {"forces",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[forces]]` for each force that acts on a body whatever the planner does "
     "([simulation](simulation.md))",
     "",
     ""},
    {"forces[].body",
     Type::text,
     {},
     0,
     required,
     "a body that can be pushed: soft, or rigid and no obstacle",
     "",
     ""},
    {"forces[].from_s", Type::number, from_to(0, 1e6), 0, "0.0", "s; when it begins, to the nearest step", "",
     ""},
    {"forces[].to_s", Type::number, from_to(0, 1e6), 0, required, "s; when it ends", "", ""},
    {"forces[].force_n", Type::vector, any, 3, required,
     "N; on the whole body, or on what is in box_m, each node by its mass", "", ""},
    {"forces[].box_m", Type::region, any, 0, may_lack,
     "m; only the nodes of its cage that are in this box at the start, in world coordinates", "", ""},

    {"pressures",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[pressures]]` for each pressure that blows a soft body up, whatever the planner does "
     "([simulation](simulation.md))",
     "",
     ""},
    {"pressures[].body", Type::text, {}, 0, required, "a soft body", "", ""},
    {"pressures[].from_s", Type::number, from_to(0, 1e6), 0, "0.0", "s; when it begins, to the nearest step",
     "", ""},
    {"pressures[].to_s", Type::number, from_to(0, 1e6), 0, required, "s; when it ends", "", ""},
    {"pressures[].pressure_pa", Type::number, any, 0, required,
     "Pa; from within on the surface of its cage, as that is then, or in the cage's hollows where it has "
     "some; "
     "below 0 it draws the body together",
     "", ""},

    {"ligaments",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[ligaments]]` for each spring between two bodies, or a body and the world "
     "([dynamics](dynamics.md#ligaments))",
     "",
     ""},
    {"ligaments[].name", Type::name, {}, 0, required, "names it in tables and in the object pass", "", ""},
    {"ligaments[].from", Type::text, {}, 0, required, "a body that is not scenery", "", ""},
    {"ligaments[].from_m", Type::vector, any, 3, required,
     "m; where it is fastened to that body at the start, in world coordinates; on its surface or in it", "",
     ""},
    {"ligaments[].to",
     Type::text,
     {},
     0,
     may_lack,
     "another body; left out: that end stands in the world",
     "",
     ""},
    {"ligaments[].to_m", Type::vector, any, 3, required, "m; the other end at the start, likewise", "", ""},
    {"ligaments[].radius_m", Type::number, from_to(0, 1e6), 0, "0.0",
     "m; all nodes of the cages so near to the ends share the pull, by their mass; 0: the nodes of the tet "
     "that "
     "the end is in",
     "", ""},
    {"ligaments[].stiffness_n_m", Type::number, from_to(1e-6, 1e9), 0, required,
     "N/m; how much more it pulls when it is longer by a metre", "", ""},
    {"ligaments[].damping_ratio", Type::number, from_to(0, 2), 0, "0.3",
     "share of the critical damping of what hangs on it", "", ""},
    {"ligaments[].rest_length", Type::number, from_to(0, 10), 0, "1.0",
     "share of its length at the start; below 1 it is taut from the start, above 1 it has slack", "", ""},
    {"ligaments[].pushes",
     Type::boolean,
     {},
     0,
     "false",
     "it pushes when it is shorter than at rest, as a spring does; else it only pulls",
     "",
     ""},
    {"ligaments[].diameter_m",
     Type::number,
     {0, 1e6, true},
     0,
     may_lack,
     "m; as it is drawn; left out: a fifteenth of its length at the start",
     "",
     ""},
    {"ligaments[].color", Type::color, {}, 0, "\"#e6dcc3\"", "as it is drawn", "", ""},

    {"motions",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[motions]]` for each rigid obstacle that goes its own way, pushes others and is not pushed",
     "",
     ""},
    {"motions[].body",
     Type::text,
     {},
     0,
     required,
     "a body with role = \"obstacle\" and kind = \"rigid\"",
     "",
     ""},
    {"motions[].keyframes",
     Type::tables,
     {},
     0,
     required,
     "where it is when; at 0 s it is in its pose, between two it goes evenly, after the last it stands",
     "",
     ""},
    {"motions[].keyframes[].at_s", Type::number, {0, 1e6, true}, 0, required, "s; ascending", "", ""},
    {"motions[].keyframes[].position_m", Type::vector, any, 3, may_lack,
     "m; of its anchor; that of its pose when not given", "", ""},
    {"motions[].keyframes[].axis", Type::vector, any, 3, "[0, 0, 1]", "of the turn, of any length but 0", "",
     ""},
    {"motions[].keyframes[].angle_deg", Type::number, from_to(-1e6, 1e6), 0, "0.0",
     "degrees; about that axis, through the anchor, from its pose; 720 turns it twice", "", ""},

    {"goal",
     Type::table,
     {},
     0,
     may_lack,
     "reached when the robot's centre of mass is within radius_m; of several goals in a row the last, those "
     "before it are `[[via]]`; a scene without can be [simulated](simulation.md), not planned",
     "",
     ""},
    {"goal.center_of_mass_m", Type::vector, any, 3, required, "m; within the bounds", "", ""},
    {"goal.moves_with",
     Type::text,
     {},
     0,
     may_lack,
     "a body that moves by itself: the goal, given for the start, moves as its centre of mass does; goes "
     "with "
     "planner.settle_time_s = 0",
     "",
     ""},
    {"goal.lost_below_m", Type::number, any, 0, may_lack,
     "m; with moves_with: the goal is lost once the lowest node of that body is below this height", "", ""},
    {"goal.radius_m", Type::number, positive, 0, may_lack,
     "m; half the robot's radius is usual; this or box_m must be given", "", ""},
    {"goal.box_m", Type::box, any, 0, may_lack,
     "m; instead of radius_m: the centre of mass comes to rest in this box, which holds center_of_mass_m", "",
     ""},
    {"goal.above", Type::text, {}, 0, may_lack, "a body: the whole robot ends higher than all of it", "", ""},
    {"goal.below", Type::text, {}, 0, may_lack, "a body: the whole robot ends lower than all of it", "", ""},
    {"goal.volume",
     Type::number,
     {1, 1000, true, false},
     0,
     may_lack,
     "a balloon (planner.max_pressure_pa) ends with its cage at least so many times as large as at rest; "
     "with "
     "planner.settle_hold",
     "",
     ""},
    {"goal.clear_of", Type::text, {}, 0, may_lack, "a body that the robot does not touch at the end", "", ""},
    {"goal.through",
     Type::names,
     {},
     0,
     may_lack,
     "rings; so many pieces of the robot are in the hole of each, in the end, as it is named times: a cord "
     "that "
     "goes through and back has two there",
     "",
     ""},
    {"goal.shape",
     Type::table,
     {},
     0,
     may_lack,
     "the robot ends turned or formed so; a tolerance must be given, and planner.hold and "
     "planner.settle_hold have no effect",
     "",
     ""},
    {"goal.shape.axis", Type::vector, any, 3, "[0.0, 0.0, 1.0]",
     "the robot is turned about it, of any length but 0", "", ""},
    {"goal.shape.angle_deg", Type::number, from_to(-360, 360), 0, "0.0",
     "degrees; from how it stands at the start", "", ""},
    {"goal.shape.stretch",
     Type::vector,
     {0.1, 10},
     3,
     "[1.0, 1.0, 1.0]",
     "of its shape at the start along x, y and z, before the turn",
     "",
     ""},
    {"goal.shape.cage",
     Type::text,
     {},
     0,
     "\"\"",
     "a .msh file with the robot's cage as it shall be, node by node, instead of stretch and turn",
     "",
     ""},
    {"goal.shape.turn_tolerance_deg", Type::number, from_to(0, 180), 0, may_lack,
     "degrees; how far it may be turned from that", "", ""},
    {"goal.shape.tolerance_m", Type::number, positive, 0, may_lack,
     "m; how far a node may be from its place in that shape, the centres of mass laid on one another", "",
     ""},
    {"goal.shape.half_turn", Type::vector, any, 3, may_lack,
     "an axis of any length but 0: turned by half a turn about it from that shape it is as good (a mattress "
     "that may lie on either face); nothing draws it there, so planner.weights.interpolation must be 0, and "
     "settle_force_share, too, where there is a settle",
     "", ""},

    {"via",
     Type::tables,
     {},
     0,
     "[]",
     "one `[[via]]` for each goal that is reached before `goal`, in this order; the search to the next "
     "begins "
     "where the last one ended, all bodies as they are then",
     "",
     ""},
    {"via[].center_of_mass_m", Type::vector, any, 3, required, "m; within the bounds", "", ""},
    {"via[].radius_m", Type::number, positive, 0, may_lack, "m; this or box_m must be given", "", ""},
    {"via[].box_m", Type::box, any, 0, may_lack, "m; instead of radius_m, as in goal", "", ""},
    {"via[].rest",
     Type::boolean,
     {},
     0,
     "false",
     "the robot comes to rest in it, as planner.settle_… say, before it goes on; else it may pass through",
     "",
     ""},
    {"via[].moves_with", Type::text, {}, 0, may_lack, "as goal.moves_with; goes with rest = false", "", ""},
    {"via[].above", Type::text, {}, 0, may_lack, "as goal.above, when it is reached", "", ""},
    {"via[].below", Type::text, {}, 0, may_lack, "as goal.below", "", ""},
    {"via[].clear_of", Type::text, {}, 0, may_lack, "as goal.clear_of", "", ""},
    {"via[].through", Type::names, {}, 0, may_lack, "as goal.through", "", ""},

    {"planner",
     Type::table,
     {},
     0,
     may_lack,
     "how the motion is searched; required where there is a goal",
     "",
     ""},
    {"planner.preset",
     Type::choice,
     {},
     0,
     "\"fast\"",
     "fast: what we found to be better; paper: the search of Rodriguez, Lien and Amato (ICRA 2006) but for "
     "what docs/table1.md names, with bodies that touch at their cages",
     "fast, paper",
     ""},
    {"planner.seed", Type::integer, from_to(0, 0x1p53 - 1), 0, "1", "of all random numbers", "", ""},
    {"planner.iterations", Type::integer, from_to(1, 1e7), 0, "1000", "gives up after so many expansions", "",
     ""},
    {"planner.goal_bias", Type::number, share, 0, "0.1", "share of the expansions that aim at the goal", "",
     ""},
    {"planner.weights",
     Type::table,
     {},
     0,
     "{}",
     "how often each manipulation is chosen; at least one is > 0",
     "",
     ""},
    {"planner.weights.body", Type::number, at_least_zero, 0, "0.6", "a force on the whole robot", "", ""},
    {"planner.weights.control_point", Type::number, at_least_zero, 0, "0.3",
     "the same force on what is round a random node: turns the robot", "", ""},
    {"planner.weights.interpolation", Type::number, at_least_zero, 0, "0.1",
     "every node towards its place at the goal; only when aiming at the goal", "", ""},
    {"planner.max_force_n", Type::number, positive, 0, required, "N; on the whole robot", "", ""},
    {"planner.max_pressure_pa", Type::number, at_least_zero, 0, "0.0",
     "Pa; > 0: the robot is a balloon, blown up by so much at most "
     "([planning](planning.md#where-it-is-pushed-and-how-hard-it-may-press))",
     "", ""},
    {"planner.force_share", Type::range, share, 0, "[0.0, 1.0]",
     "of max_force_n; each force is drawn evenly between the two", "", "[0.8, 1.0]"},
    {"planner.duration_s",
     Type::range,
     {0, 100, true},
     0,
     "[0.2, 1.0]",
     "s; a manipulation is held for a time drawn evenly between the two",
     "",
     "[0.2, 3.0]"},
    {"planner.control_point_radius_m", Type::number, positive, 0, "0.25",
     "m; round the node, in the rest shape; wider where that is less than a tenth of the robot's mass", "",
     ""},
    {"planner.patches_m", Type::boxes, any, 0, "[]",
     "m; in world coordinates at the start: the robot is pushed there alone, where it is pushed at control "
     "points; one box as often as another, each at the node of the robot's cage in it that is nearest to its "
     "middle",
     "", ""},
    {"planner.lead",
     Type::boolean,
     {},
     0,
     "false",
     "the first of these patches leads: the mean of its nodes, by mass, is what is near, guided and in a "
     "goal, "
     "wherever the centre of mass is; goes with weights.interpolation = 0 and settle_time_s = 0",
     "",
     ""},
    {"planner.carry",
     Type::boolean,
     {},
     0,
     "false",
     "two carriers have hold of these patches, of which there are two, and push both at once, each by up to "
     "max_force_n: each finds its way to its own place in the goal's shape, and nodes are near by both",
     "",
     ""},
    {"planner.settle_time_s", Type::number, from_to(0, 100), 0, "3.0",
     "s; at the goal the robot is given at most so long to come to rest", "", ""},
    {"planner.settle_speed_m_s", Type::number, positive, 0, "0.02",
     "m/s; mean speed below which it is at rest", "", ""},
    {"planner.settle_force_share", Type::number, share, 0, "1.0",
     "of max_force_n; the largest force while it comes to rest", "", ""},
    {"planner.settle_hold",
     Type::boolean,
     {},
     0,
     "true",
     "it may come to rest in any turn and shape: its centre of mass is held and every node slowed; false: it "
     "is "
     "interpolated into its shape at the goal, as in the paper; no effect with goal.shape",
     "",
     ""},
    {"planner.lag", Type::integer, from_to(0, 65535), 0, "0",
     "an expansion knows the nodes of all expansions but so many before it, which are computed beside it", "",
     "3"},
    {"planner.metric",
     Type::choice,
     {},
     0,
     "\"distance\"",
     "what the nearest node is nearest by: distance of centres of mass, or the time that its robot needs "
     "under "
     "the largest force from its place and velocity",
     "distance, time_to_go",
     "\"time_to_go\""},
    {"planner.time_weight", Type::number, share, 0, "0.0",
     "with time_to_go: how much the time counts at which a node is reached", "", ""},
    {"planner.guidance", Type::number, share, 0, "0.0",
     "share of the expansions that are led by the cheapest way to the goal over a grid of the workspace", "",
     "0.8"},
    {"planner.soft_price", Type::number, at_least_zero, 0, "100.0",
     "with guidance: what a metre costs, over a free one, where nothing of the robot's radius fits between "
     "soft "
     "things",
     "", ""},
    {"planner.density_price", Type::number, at_least_zero, 0, "0.0",
     "with guidance: each node that was in a node's place before it counts against it as so many tries of "
     "its "
     "own; above 0 a search goes back from where something free shuts the way",
     "", ""},
    {"planner.learn_prices",
     Type::boolean,
     {},
     0,
     "false",
     "with guidance: where a push does not get on, going on gets dearer",
     "",
     "true"},
    {"planner.steer",
     Type::boolean,
     {},
     0,
     "false",
     "a push reckons with the robot's velocity and lasts as long as the way should take, within duration_s",
     "",
     "true"},
    {"planner.look_s", Type::number, from_to(0, 100), 0, "0.0",
     "s; a push is looked at so often on its way; 0: never", "", "0.1"},
    {"planner.stop_in_goal", Type::boolean, {}, 0, "false", "a push seen in the goal ends there", "", "true"},
    {"planner.hold",
     Type::boolean,
     {},
     0,
     "false",
     "at the goal the robot may have turned: its centre of mass is held there and every node slowed, instead "
     "of "
     "interpolated",
     "",
     "true"},
    {"planner.end_hopeless",
     Type::boolean,
     {},
     0,
     "false",
     "a push seen to get nowhere, or to lead away, ends there",
     "",
     "true"},
    {"planner.shortcut_rounds", Type::integer, from_to(0, 1e5), 0, "0",
     "rounds of sixteen changes that are tried on the path that was found, to make it shorter", "", ""},

    {"camera", Type::table, {}, 0, "{}", "framed automatically unless there are keyframes", "", ""},
    {"camera.direction", Type::vector, any, 3, "[-0.35, -1.0, 0.45]",
     "from the scene to the camera, of any length but 0", "", ""},
    {"camera.fov_deg", Type::number, from_to(1, 120), 0, "30.0", "degrees; vertical opening", "", ""},
    {"camera.keyframes", Type::tables, {}, 0, "[]", "the camera moves smoothly from one to the next", "", ""},
    {"camera.keyframes[].at", Type::number, share, 0, required, "share of the film; ascending", "", ""},
    {"camera.keyframes[].eye_m", Type::vector, any, 3, required, "m; where the camera is", "", ""},
    {"camera.keyframes[].target_m", Type::vector, any, 3, required, "m; what it looks at", "", ""},

    {"camera.turn_deg", Type::number, any, 0, "0.0",
     "degrees; the camera walks so far round what it looks at, counter-clockwise seen from above", "", ""},
    {"camera.follow",
     Type::text,
     {},
     0,
     may_lack,
     "name of a body; the camera goes along with its centre of mass",
     "",
     ""},
    {"camera.subject",
     Type::bodies,
     {},
     0,
     may_lack,
     "a body, or a list of bodies: their motion is framed, and not that of all; without follow and keyframes",
     "",
     ""},
    {"camera.fill",
     Type::number,
     {0.01, 1},
     0,
     "0.88",
     "share of the picture, across or upright, that what is framed takes up",
     "",
     ""},
    {"cameras",
     Type::tables,
     {},
     0,
     "[]",
     "more cameras, for `limber render --camera NAME`; the keys of `camera`, and a name",
     "",
     ""},
    {"cameras[].name",
     Type::name,
     {},
     0,
     required,
     "names its film; not \"main\", which is `camera`",
     "",
     ""},
    {"cameras[].direction", Type::vector, any, 3, "[-0.35, -1.0, 0.45]", "as of `camera`", "", ""},
    {"cameras[].fov_deg", Type::number, from_to(1, 120), 0, "30.0", "degrees", "", ""},
    {"cameras[].keyframes", Type::tables, {}, 0, "[]", "as of `camera`", "", ""},
    {"cameras[].keyframes[].at", Type::number, share, 0, required, "share of the film; ascending", "", ""},
    {"cameras[].keyframes[].eye_m", Type::vector, any, 3, required, "m", "", ""},
    {"cameras[].keyframes[].target_m", Type::vector, any, 3, required, "m", "", ""},
    {"cameras[].turn_deg", Type::number, any, 0, "0.0", "degrees", "", ""},
    {"cameras[].follow", Type::text, {}, 0, may_lack, "name of a body", "", ""},
    {"cameras[].subject", Type::bodies, {}, 0, may_lack, "as of `camera`", "", ""},
    {"cameras[].fill", Type::number, {0.01, 1}, 0, "0.88", "as of `camera`", "", ""},

    {"film", Type::table, {}, 0, "{}", "what is rendered", "", ""},
    {"film.size_px", Type::integers, from_to(16, 8192), 2, "[1920, 1080]", "pixels; width and height", "",
     ""},
    {"film.frames_per_second", Type::integer, from_to(1, 1000), 0, "30",
     "of the film, and, but for `speed`, of the states that a plan stores", "", ""},
    {"film.speed",
     Type::number,
     {1e-3, 100},
     0,
     "1.0",
     "of the film; 0.25: four times as slow as the motion",
     "",
     ""},
    {"film.pace",
     Type::choice,
     {},
     0,
     "\"steady\"",
     "time goes on evenly; or slowly where something presses the robot and quickly where nothing does, with "
     "smooth changes ([rendering](rendering.md#time))",
     "steady, contact",
     ""},
    {"film.pace_range",
     Type::range,
     {0.01, 100},
     0,
     "[0.25, 1.5]",
     "times `speed`; with the pace contact: in contact, and away from it",
     "",
     ""},
    {"film.length_s",
     Type::number,
     {0.01, 36000},
     0,
     may_lack,
     "s; with the pace contact: how long the motion takes in the film, within pace_range; else as comes out",
     "",
     ""},
    {"film.end",
     Type::choice,
     {},
     0,
     "\"path\"",
     "with the path; or half a second after nothing moves any more by more than 0.3 % of the robot's size",
     "path, rest",
     ""},
    {"film.look",
     Type::choice,
     {},
     0,
     "\"studio\"",
     "light, ground and background: a warm lamp in a cool room; a dark room; soft white light; or a sheet of "
     "paper, without a horizon",
     "studio, dark, clinical, paper",
     ""},
    {"film.background",
     Type::color,
     {},
     0,
     may_lack,
     "`\"#rrggbb\"`: sky and far ground are of this one colour, without a horizon; else the look's",
     "",
     ""},
    {"film.ground_m",
     Type::number,
     {-1e6, 1e6},
     0,
     may_lack,
     "m; how high the ground lies in the picture; else the floor of the bounds, or what of the scenery is "
     "lowest",
     "",
     ""},
    {"film.bounds_lines",
     Type::boolean,
     {},
     0,
     "true",
     "draw the edges of the bounds as thin pale lines",
     "",
     ""},
    {"film.transparent",
     Type::boolean,
     {},
     0,
     "false",
     "no ground and no background: frames with alpha, shadows in it; the film is over white",
     "",
     ""},
    {"film.caption",
     Type::text,
     {},
     0,
     "\"\"",
     "a line in that corner of the picture where it hides least of the bodies, over the film",
     "",
     ""},
    {"film.clock",
     Type::boolean,
     {},
     0,
     "false",
     "the motion's time, and how slow or quick the film is, below it",
     "",
     ""},
    {"film.scale_bar",
     Type::boolean,
     {},
     0,
     "false",
     "a bar of a round length, as long as that is at the distance the camera looks at",
     "",
     ""},
    {"film.color_by",
     Type::choice,
     {},
     0,
     "\"body\"",
     "what colours mean: each body's own; or by von Mises strain, change of volume, depth of contact, or "
     "speed, with a bar of colours",
     "body, strain, volume, penetration, speed",
     ""},
    {"film.color_range", Type::range, any, 0, may_lack,
     "lower and upper end of the bar (of volume: shares), the same in every frame; else over the whole "
     "motion",
     "", ""},
    {"film.cages", Type::boolean, {}, 0, "false", "draw the edges of the cages over the surfaces", "", ""},
    {"film.forces",
     Type::boolean,
     {},
     0,
     "false",
     "arrows where they leave the robot: the push that drives it, orange, as long as the robot where it is "
     "strongest (interpolation and holding: the sum over all nodes, along a line through the centre of "
     "mass); what each body and the walls do to it, blue, at most twice as long; the scene's `[[forces]]`, "
     "orange, where they leave their bodies; where nothing pushes, what the robot weighs is as long as it",
     "",
     ""},
    {"film.path", Type::boolean, {}, 0, "false", "draw the way of the robot's centre of mass", "", ""},
    {"film.tree",
     Type::boolean,
     {},
     0,
     "false",
     "draw the tree that was searched, by centres of mass",
     "",
     ""},
    {"film.side_by_side",
     Type::boolean,
     {},
     0,
     "false",
     "the fine surfaces on the left, the cages that are simulated on the right",
     "",
     ""},
    {"film.panes",
     Type::boolean,
     {},
     0,
     "false",
     "where a body that nothing holds presses a wall of the bounds, other than the floor, a faint pane "
     "stands behind it",
     "",
     ""},
    {"film.outlines",
     Type::boolean,
     {},
     0,
     "false",
     "dark lines along the silhouettes and creases of all that is opaque",
     "",
     ""},
    {"film.labels",
     Type::labels,
     {},
     0,
     "false",
     "names beside what is seen, with lines to it: of all bodies; of those in a list; or of those in a "
     "table, "
     "called as it says. A body lung_left is called Left lung. A name is there where its body is seen",
     "",
     ""},
    {"film.cuts", Type::tables, {}, 0, "[]", "planes that open bodies in the picture, at most six", "", ""},
    {"film.cuts[].point_m", Type::vector, any, 3, required, "m; a point of the plane", "", ""},
    {"film.cuts[].normal", Type::vector, any, 3, required,
     "of any length but 0; what lies on its side of the plane is taken away", "", ""},
    {"film.cuts[].bodies",
     Type::names,
     {},
     0,
     may_lack,
     "bodies that it cuts; else scenery, and bodies with an opacity below 1",
     "",
     ""},
    {"film.inset", Type::table, {}, 0, may_lack, "a second camera's picture, in a corner", "", ""},
    {"film.inset.camera",
     Type::text,
     {},
     0,
     required,
     "one of `cameras`, or \"main\"; the film of that camera itself has no inset",
     "",
     ""},
    {"film.inset.size",
     Type::number,
     {0.1, 0.5},
     0,
     "0.3",
     "share of the film's width; it has the film's shape, and stands where it hides least of the bodies",
     "",
     ""},
    {"film.title", Type::table, {}, 0, may_lack, "words before the motion", "", ""},
    {"film.title.text", Type::text, {}, 0, required, "lines, parted by \\n; the first is larger", "", ""},
    {"film.title.duration_s",
     Type::number,
     {0.1, 60},
     0,
     "2.5",
     "s; it gives way in the last half second",
     "",
     ""},
    {"film.title.ground",
     Type::choice,
     {},
     0,
     "\"picture\"",
     "over the motion's first picture, blurred and dimmed; or on a plain ground",
     "picture, plain",
     ""},
    {"film.end_card", Type::table, {}, 0, may_lack, "words after the motion, over its last picture", "", ""},
    {"film.end_card.text", Type::text, {}, 0, required, "as of `film.title`", "", ""},
    {"film.end_card.duration_s", Type::number, {0.1, 60}, 0, "2.5", "s", "", ""},
    {"film.end_card.ground", Type::choice, {}, 0, "\"picture\"", "as of `film.title`", "picture, plain", ""},
    {"film.sheet", Type::integers, from_to(1, 20), 2, "[4, 3]", "columns and rows of the contact sheet", "",
     ""},
};

[[noreturn]] void complain(const Where& where, const std::string& what) {
  throw InputError(fmt::format("{}: {}", where.text(), what));
}

[[noreturn]] void complain_of_type(const Key& key, const std::string& shown, const Node& node) {
  if (key.path == "goal" && node.array())
    complain(node.where,
             "there is one goal, the last; write [goal], and [[via]] for each that comes before it");
  if (shown.ends_with(']') && !key.path.ends_with("]"))
    complain(node.where, fmt::format("{} must be {}; its element {} is {}; write for example {}",
                                     shown.substr(0, shown.rfind('[')), key.expected(),
                                     shown.substr(shown.rfind('[')), node.type_name(), key.example()));
  complain(node.where, fmt::format("{} must be {}, not {}; write for example {}", shown, key.expected(),
                                   node.type_name(), key.example()));
}

double checked_number(const Key& key, const std::string& shown, const Node& node) {
  double x = 0;
  if (const auto* integer = std::get_if<std::int64_t>(&node.value))
    x = double(*integer);
  else if (const auto* number = std::get_if<double>(&node.value))
    x = *number;
  else
    complain_of_type(key, shown, node);
  if (!std::isfinite(x)) complain(node.where, fmt::format("{} is {}; write a finite number", shown, x));
  if (!key.interval.holds(x)) {
    const bool slip = (x > huge && key.interval.upper == huge) || (x < -huge && key.interval.lower == -huge);
    complain(node.where,
             fmt::format("{} is {}, out of its range; it must be {}", shown, x,
                         slip ? fmt::format("between {} and {}", -huge, huge) : key.interval.text()));
  }
  if ((key.type == Type::integer || key.type == Type::integers) && x != std::floor(x))
    complain(node.where, fmt::format("{} is {}; it must be a whole number", shown, x));
  return x;
}

const Array& checked_list(const Key& key, const std::string& shown, const Node& node, std::size_t count) {
  const Array* elements = node.array();
  if (!elements) complain_of_type(key, shown, node);
  if (elements->size() != count)
    complain(node.where, fmt::format("{} has {} elements; it must be {}, for example {}", shown,
                                     elements->size(), key.expected(), key.example()));
  return *elements;
}

std::vector<double> checked_numbers(const Key& key, const std::string& shown, const Node& node,
                                    std::size_t count) {
  std::vector<double> numbers;
  for (const Node& element : checked_list(key, shown, node, count))
    numbers.push_back(checked_number(key, fmt::format("{}[{}]", shown, numbers.size()), element));
  return numbers;
}

const std::string& checked_text(const Key& key, const std::string& shown, const Node& node) {
  const auto* text = std::get_if<std::string>(&node.value);
  if (!text) complain_of_type(key, shown, node);
  return *text;
}

std::vector<std::string> split_choices(std::string_view choices) {
  std::vector<std::string> made;
  while (!choices.empty()) {
    const auto comma = std::min(choices.find(", "), choices.size());
    made.emplace_back(choices.substr(0, comma));
    choices.remove_prefix(std::min(choices.size(), comma + 2));
  }
  return made;
}

void check_table(Node& node, const std::string& path, const std::string& shown, const Complaints&);

void check_choice(const Key& key, const std::string& shown, const Node& node) {
  const std::string& text = checked_text(key, shown, node);
  const auto choices = split_choices(key.choices);
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) return;
  const std::string meant = nearest(text, choices);
  complain(node.where, fmt::format("{} is \"{}\"; it must be {}{}", shown, text, key.expected(),
                                   meant.empty() ? "" : fmt::format("; did you mean \"{}\"?", meant)));
}

void check_name(const Key& key, const std::string& shown, const Node& node) {
  const std::string& text = checked_text(key, shown, node);
  const auto allowed = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (text.empty() || text.size() > 64 || !std::all_of(text.begin(), text.end(), allowed))
    complain(node.where,
             fmt::format("{} is \"{}\"; use 1 to 64 letters, digits, _ and - (it becomes a file name)", shown,
                         text));
}

void check_color(const Key& key, const std::string& shown, const Node& node) {
  const std::string& text = checked_text(key, shown, node);
  const auto hexadecimal = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if (text.size() != 7 || text[0] != '#' || !std::all_of(text.begin() + 1, text.end(), hexadecimal))
    complain(node.where,
             fmt::format("{} is \"{}\"; write \"#rrggbb\" with hexadecimal digits, for example {}", shown,
                         text, key.example()));
}

void check_box(const Key& key, const std::string& shown, const Node& node) {
  const Array& corners = checked_list(key, shown, node, 2);
  const auto lower = checked_numbers(key, shown + "[0]", corners[0], 3);
  const auto upper = checked_numbers(key, shown + "[1]", corners[1], 3);
  for (std::size_t i = 0; i < 3; ++i)
    if (key.type == Type::region ? lower[i] > upper[i] : lower[i] >= upper[i])
      complain(
          corners[1].where,
          fmt::format("{} has upper {} = {}, which is not above lower {} = {}; write the lower corner first",
                      shown, "xyz"[i], upper[i], "xyz"[i], lower[i]));
}

void check_boxes(const Key& key, const std::string& shown, const Node& node) {
  const Array* elements = node.array();
  if (!elements) complain_of_type(key, shown, node);
  for (std::size_t i = 0; i < elements->size(); ++i)
    check_box(key, fmt::format("{}[{}]", shown, i), (*elements)[i]);
}

void check_points(const Key& key, const std::string& shown, const Node& node) {
  const Array* elements = node.array();
  if (!elements) complain_of_type(key, shown, node);
  if (elements->size() < 2)
    complain(node.where, fmt::format("{} has {} points; write two at least", shown, elements->size()));
  for (std::size_t i = 0; i < elements->size(); ++i)
    checked_numbers(key, fmt::format("{}[{}]", shown, i), (*elements)[i], 3);
}

void check_fixed(const Key& key, const std::string& shown, Node& node, const Complaints& complaints) {
  const auto is_walls = [](const Node& n) {
    const auto* text = std::get_if<std::string>(&n.value);
    return text && *text == "walls";
  };
  if (is_walls(node)) return;
  auto* elements = std::get_if<Array>(&node.value);
  if (!elements) complain_of_type(key, shown, node);
  for (std::size_t i = 0; i < elements->size(); ++i) {
    Node& element = (*elements)[i];
    if (is_walls(element)) continue;
    const std::string element_shown = fmt::format("{}[{}]", shown, i);
    if (!element.table()) complain_of_type(key, element_shown, element);
    check_table(element, "bodies[].fixed[]", element_shown, complaints);
  }
}

void check_names(const Key& key, const std::string& shown, const Node& node) {
  const Array* elements = node.array();
  if (!elements) complain_of_type(key, shown, node);
  for (std::size_t i = 0; i < elements->size(); ++i)
    checked_text(key, fmt::format("{}[{}]", shown, i), (*elements)[i]);
}

void check_bodies(const Key& key, const std::string& shown, const Node& node) {
  if (std::holds_alternative<std::string>(node.value)) return;
  check_names(key, shown, node);
  if (node.array()->empty()) complain(node.where, fmt::format("{} names no body; it must name one", shown));
}

void check_labels(const Key& key, const std::string& shown, const Node& node) {
  if (std::holds_alternative<bool>(node.value)) return;
  if (!node.table()) return check_names(key, shown, node);
  for (const Entry& entry : *node.table())
    if (!std::holds_alternative<std::string>(entry.value.value))
      complain(entry.value.where, fmt::format("{}.{} is {}; it must be a text, what the body is called",
                                              shown, entry.key, entry.value.type_name()));
}

// "bodies.robot" for the body of that name, else "bodies[2]".
std::string shown_element(const std::string& shown, std::size_t i, const Node& element) {
  const Node* name = element.find("name");
  const auto* text = name ? std::get_if<std::string>(&name->value) : nullptr;
  return text && !text->empty() ? fmt::format("{}.{}", shown, *text) : fmt::format("{}[{}]", shown, i);
}

void check_value(const Key& key, const std::string& shown, Node& node, const Complaints& complaints) {
  switch (key.type) {
    case Type::text:
      checked_text(key, shown, node);
      return;
    case Type::name:
      return check_name(key, shown, node);
    case Type::choice:
      return check_choice(key, shown, node);
    case Type::number:
    case Type::integer:
      checked_number(key, shown, node);
      return;
    case Type::boolean:
      if (!std::holds_alternative<bool>(node.value)) complain_of_type(key, shown, node);
      return;
    case Type::vector:
    case Type::integers:
      checked_numbers(key, shown, node, std::size_t(key.count));
      return;
    case Type::range: {
      const auto ends = checked_numbers(key, shown, node, 2);
      if (ends[0] > ends[1])
        complain(node.where,
                 fmt::format("{} runs from {} to {}; write the smaller one first", shown, ends[0], ends[1]));
      return;
    }
    case Type::box:
    case Type::region:
      return check_box(key, shown, node);
    case Type::boxes:
      return check_boxes(key, shown, node);
    case Type::points:
      return check_points(key, shown, node);
    case Type::color:
      return check_color(key, shown, node);
    case Type::fixed:
      return check_fixed(key, shown, node, complaints);
    case Type::names:
      return check_names(key, shown, node);
    case Type::bodies:
      return check_bodies(key, shown, node);
    case Type::labels:
      return check_labels(key, shown, node);
    case Type::table:
      if (!node.table()) complain_of_type(key, shown, node);
      return check_table(node, std::string(key.path), shown, complaints);
    case Type::tables: {
      auto* elements = std::get_if<Array>(&node.value);
      if (!elements) complain_of_type(key, shown, node);
      for (std::size_t i = 0; i < elements->size(); ++i) {
        Node& element = (*elements)[i];
        complaints.during([&] {
          if (!element.table()) complain_of_type(key, fmt::format("{}[{}]", shown, i), element);
          check_table(element, std::string(key.path) + "[]", shown_element(shown, i, element), complaints);
        });
      }
      return;
    }
  }
}

bool fast_preset(const Node& planner) {
  const Node* preset = planner.find("preset");
  const auto* text = preset ? std::get_if<std::string>(&preset->value) : nullptr;
  return !text || *text != "paper";
}

Node fallback_of(const Key& key, const Node& parent) {
  const bool fast = !key.fast.empty() && fast_preset(parent);
  Node node = parse_set_value(std::string(fast ? key.fast : key.fallback), parent.where.source);
  node.where = parent.where;
  return node;
}

void check_table(Node& node, const std::string& path, const std::string& shown,
                 const Complaints& complaints) {
  const auto known = keys_in(path);
  const std::string prefix = shown.empty() ? "" : shown + ".";
  for (Entry& entry : std::get<Table>(node.value)) {
    const auto at =
        std::find_if(known.begin(), known.end(), [&](const Key* k) { return k->name() == entry.key; });
    complaints.during([&] {
      if (at == known.end())
        complain(entry.where, fmt::format("unknown key \"{}\"{}; {}", entry.key,
                                          shown.empty() ? std::string() : fmt::format(" in {}", shown),
                                          suggestion(path, entry.key)));
      check_value(**at, prefix + entry.key, entry.value, complaints);
    });
  }
  for (const Key* key : known) {
    if (node.find(key->name()) || key->fallback == may_lack) continue;
    complaints.during([&] {
      if (key->fallback == required)
        complain(node.where, fmt::format("{} lacks \"{}\" ({}); add {}", shown.empty() ? "the scene" : shown,
                                         key->name(), key->meaning, key->example()));
      Entry added{std::string(key->name()), node.where, fallback_of(*key, node)};
      check_value(*key, prefix + added.key, added.value, complaints);
      std::get<Table>(node.value).push_back(std::move(added));
    });
  }
}

// Edits that turn a into b: insert, delete, replace, swap two neighbours.
}  // namespace

bool Interval::holds(double x) const {
  return (above_lower ? x > lower : x >= lower) && (below_upper ? x < upper : x <= upper);
}

std::string Interval::text() const {
  std::string made;
  if (lower > -huge) made = fmt::format("{} {}", above_lower ? ">" : "≥", lower);
  if (upper != huge)
    made += fmt::format("{}{} {}", made.empty() ? "" : " and ", below_upper ? "<" : "≤", upper);
  return made;
}

std::string_view Key::parent() const {
  const auto dot = path.rfind('.');
  return dot == path.npos ? std::string_view() : path.substr(0, dot);
}
std::string_view Key::name() const {
  const auto dot = path.rfind('.');
  return dot == path.npos ? path : path.substr(dot + 1);
}

std::string Key::expected() const {
  const std::string range = interval.text().empty() ? std::string() : fmt::format(" {}", interval.text());
  switch (type) {
    case Type::text:
      return "a text";
    case Type::name:
      return "a name";
    case Type::choice: {
      const auto words = split_choices(choices);
      std::string made;
      for (std::size_t i = 0; i < words.size(); ++i)
        made += fmt::format("{}\"{}\"", i == 0 ? "" : i + 1 == words.size() ? " or " : ", ", words[i]);
      return made;
    }
    case Type::number:
      return "a number" + range;
    case Type::integer:
      return "a whole number" + range;
    case Type::boolean:
      return "true or false";
    case Type::vector:
      return fmt::format("a list of {} numbers{}", count, range);
    case Type::integers:
      return fmt::format("a list of {} whole numbers{}", count, range);
    case Type::range:
      return fmt::format("a list [from, to] of two numbers{}", range);
    case Type::box:
    case Type::region:
      return "two corners [[x, y, z], [x, y, z]], the lower one first";
    case Type::boxes:
      return "a list of boxes [[x, y, z], [x, y, z]], the lower corner first";
    case Type::points:
      return "a list of points [x, y, z], two at least";
    case Type::color:
      return "a colour \"#rrggbb\"";
    case Type::fixed:
      return "\"walls\", or a list of \"walls\" and { box_m = [[x, y, z], [x, y, z]] }";
    case Type::names:
      return "a list of texts";
    case Type::bodies:
      return "a body, or a list of bodies";
    case Type::labels:
      return "true or false, a list of bodies, or a table BODY = \"name\"";
    case Type::table:
      return "a table";
    case Type::tables:
      return "a list of tables";
  }
  return "";
}

std::string Key::example() const {
  const bool telling = fallback != required && fallback != may_lack &&
                       fallback.find_first_of("{}") == fallback.npos && fallback != "[]";
  if (type == Type::table && parent().empty()) return fmt::format("[{}]", path);
  if (type == Type::tables) return fmt::format("[[{}]]", path);
  const auto value = [&]() -> std::string {
    if (telling) return std::string(fallback);
    const double inside = std::clamp(1.0, interval.lower, interval.upper);
    switch (type) {
      case Type::text:
      case Type::bodies:
        return "\"…\"";
      case Type::name:
        return "\"robot\"";
      case Type::choice:
        return fmt::format("\"{}\"", split_choices(choices).front());
      case Type::number:
        return fmt::format("{:.1f}", inside);
      case Type::integer:
        return fmt::format("{}", std::max(1.0, interval.lower));
      case Type::boolean:
        return "true";
      case Type::vector:
        return count == 2 ? "[1.0, 1.0]" : "[1.0, 1.0, 1.0]";
      case Type::integers:
        return count == 2 ? "[3, 3]" : "[3, 3, 3]";
      case Type::range:
        return "[0.5, 1.0]";
      case Type::box:
      case Type::region:
        return "[[0, 0, 0], [10, 3, 3]]";
      case Type::boxes:
        return "[[[0, 0, 0], [1, 1, 1]]]";
      case Type::points:
        return "[[0, 0, 0], [1, 0, 0]]";
      case Type::color:
        return "\"#c0392b\"";
      case Type::fixed:
        return "\"walls\"";
      case Type::names:
        return "[\"…\"]";
      case Type::labels:
        return "true";
      case Type::table:
        return "{ … }";
      case Type::tables:
        break;
    }
    return "";
  };
  return fmt::format("{} = {}", name(), value());
}

std::span<const Key> keys() { return all_keys; }

const Key* find_key(std::string_view path) {
  for (const Key& key : all_keys)
    if (key.path == path) return &key;
  return nullptr;
}

std::vector<const Key*> keys_in(std::string_view path) {
  std::vector<const Key*> made;
  for (const Key& key : all_keys)
    if (key.parent() == path) made.push_back(&key);
  return made;
}

std::string suggestion(std::string_view parent_path, std::string_view unknown) {
  std::vector<std::string> names;
  for (const Key* key : keys_in(parent_path)) names.emplace_back(key->name());
  for (const Key& key : all_keys)
    if (key.name() == unknown && key.parent() != parent_path && key.parent().starts_with(parent_path))
      return fmt::format("{} belongs into {}", unknown, key.parent());
  const std::string meant = nearest(unknown, names);
  if (!meant.empty()) return fmt::format("did you mean \"{}\"?", meant);
  return fmt::format("known here: {}", fmt::join(names, ", "));
}

void check_and_complete(Node& root, const Complaints& complaints) { check_table(root, "", "", complaints); }

}  // namespace limber::scenes
