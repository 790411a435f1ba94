// What a result depends on, key by key: each key of a scene changes the identity of what it shapes, and of
// nothing else. A new key wants its row here.
#include <gmock/gmock.h>

#include <map>
#include <numeric>
#include <set>

#include "core/hash.h"
#include "core/mesh_files.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/fem_system.h"
#include "limber/detail/world/scene_world.h"
#include "scenes/detail/schema.h"
#include "tests/cli/program.h"
#include "tests/core/node_order.h"

namespace limber::detail {
namespace {

enum Shapes : unsigned { nothing = 0, world = 1, search = 2, film = 4 };
struct Row {
  const char* key;
  const char* set;         // "bodies.block.material.friction=0.3"
  unsigned shapes;         // world: the dynamics and what a goal asks for; search: the planner's settings
  const char* given = "";  // sets of both scenes before that, parted by |
};

// One body a kind of model, read but not prepared. Keys that shape a mesh: [body, key, set].
constexpr const char* models = R"(name = "models"
[world]
bounds_m = [[-9, -9, -9], [9, 9, 9]]
[[bodies]]
name = "file"
role = "robot"
model = { file = "one.obj" }
cage = { tets = 60 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
[[bodies]]
name = "made"
role = "obstacle"
kind = "rigid"
model = { made = "heart" }
cage = { tets = 60 }
[[bodies]]
name = "box"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [1, 1, 1], triangle_m = 0.5 } }
cage = { cells = [2, 2, 2] }
[[bodies]]
name = "plate"
role = "obstacle"
kind = "rigid"
model = { plate = { size_m = [2, 2, 0.2], triangle_m = 0.5, hole = { size_m = 0.5 } } }
cage = { tets = 60 }
[[bodies]]
name = "blocks"
role = "obstacle"
kind = "rigid"
model = { blocks = { solids = [[[0, 0, 0], [1, 1, 1]]], triangle_m = 0.5 } }
cage = { cell_m = 0.5 }
[[bodies]]
name = "ball"
role = "obstacle"
kind = "rigid"
model = { sphere = { diameter_m = 1, triangle_m = 0.3 } }
cage = { tets = 60 }
[[bodies]]
name = "tube"
role = "obstacle"
kind = "rigid"
model = { tube = { path_m = [[0, 0, 0], [1, 0, 0]], diameter_m = 0.4, triangle_m = 0.2 } }
cage = { cells = [2, 2, 4] }
[goal]
center_of_mass_m = [1, 1, 1]
radius_m = 0.3
[planner]
max_force_n = 10
)";
struct MeshRow {
  const char *body, *key, *set, *given = "";
};
const std::vector<MeshRow> mesh_rows{
    {"file", "bodies[].model.file", "bodies.file.model.file=two.obj"},
    {"file", "bodies[].model.scale", "bodies.file.model.scale=0.5"},
    {"file", "bodies[].model.height_m", "bodies.file.model.height_m=0.5"},
    {"made", "bodies[].model.height_m", "bodies.made.model.height_m=0.5"},
    {"file", "bodies[].model.up", "bodies.file.model.up=-z"},
    {"file", "bodies[].model.front", "bodies.file.model.front=+y"},
    {"made", "bodies[].model.made", "bodies.made.model.made=liver"},
    {"box", "bodies[].model.box.size_m", "bodies.box.model.box.size_m=[1, 1, 1.1]"},
    {"box", "bodies[].model.box.bevel_m", "bodies.box.model.box.bevel_m=0.1"},
    {"box", "bodies[].model.box.triangle_m", "bodies.box.model.box.triangle_m=0.2"},
    {"plate", "bodies[].model.plate.size_m", "bodies.plate.model.plate.size_m=[2, 2, 0.3]"},
    {"plate", "bodies[].model.plate.bevel_m", "bodies.plate.model.plate.bevel_m=0.05"},
    {"plate", "bodies[].model.plate.triangle_m", "bodies.plate.model.plate.triangle_m=0.2"},
    {"plate", "bodies[].model.plate.hole.shape", "bodies.plate.model.plate.hole.shape=square"},
    {"plate", "bodies[].model.plate.hole.size_m", "bodies.plate.model.plate.hole.size_m=0.6"},
    {"plate", "bodies[].model.plate.hole.center_m", "bodies.plate.model.plate.hole.center_m=[0.1, 0]"},
    {"blocks", "bodies[].model.blocks.solids", "bodies.blocks.model.blocks.solids=[[[0, 0, 0], [1, 1, 2]]]"},
    {"blocks", "bodies[].model.blocks.holes",
     "bodies.blocks.model.blocks.holes=[[[0.4, 0.4, -1], [0.6, 0.6, 2]]]"},
    {"blocks", "bodies[].model.blocks.bevel_m", "bodies.blocks.model.blocks.bevel_m=0.1"},
    {"blocks", "bodies[].model.blocks.triangle_m", "bodies.blocks.model.blocks.triangle_m=0.2"},
    {"ball", "bodies[].model.sphere.diameter_m", "bodies.ball.model.sphere.diameter_m=1.1"},
    {"ball", "bodies[].model.sphere.triangle_m", "bodies.ball.model.sphere.triangle_m=0.2"},
    {"tube", "bodies[].model.tube.path_m", "bodies.tube.model.tube.path_m=[[0, 0, 0], [1, 0.1, 0]]"},
    {"tube", "bodies[].model.tube.diameter_m", "bodies.tube.model.tube.diameter_m=0.3"},
    {"tube", "bodies[].model.tube.wall_m", "bodies.tube.model.tube.wall_m=0.1",
     "bodies.tube.cage.cells=[8, 8, 4]"},
    {"tube", "bodies[].model.tube.triangle_m", "bodies.tube.model.tube.triangle_m=0.1"},
    {"file", "bodies[].cage.tets", "bodies.file.cage.tets=80"},
    {"file", "bodies[].cage.mode", "bodies.file.cage.mode=fast"},
    {"file", "bodies[].cage.shells", "bodies.file.cage.shells=3"},
    {"box", "bodies[].cage.cells", "bodies.box.cage.cells=[2, 2, 3]"},
    {"blocks", "bodies[].cage.cell_m", "bodies.blocks.cage.cell_m=0.25"},
    {"ball", "bodies[].pose.anchor", "bodies.ball.pose.anchor=bottom"},
    {"ball", "bodies[].pose.axis", "bodies.ball.pose.axis=[1, 0, 0]", "bodies.ball.pose.angle_deg=10"},
    {"ball", "bodies[].pose.angle_deg", "bodies.ball.pose.angle_deg=10"}};

// Bodies that are prepared once; what follows changes none of their meshes.
constexpr const char* stage = R"(name = "stage"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
[[bodies]]
name = "robot"
role = "robot"
contact = "surface"
deformation = "linear"
model = { box = { size_m = [0.5, 0.5, 0.5], bevel_m = 0.1, triangle_m = 0.2 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [0.6, 1, 1.3] }
[[bodies]]
name = "block"
role = "obstacle"
contact = "surface"
deformation = "linear"
model = { box = { size_m = [0.4, 1, 0.5], bevel_m = 0.1, triangle_m = 0.2 } }
cage = { cells = [2, 2, 2], shells = 2 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [2, 1, 0.3] }
[[bodies]]
name = "cart"
role = "free"
contact = "surface"
deformation = "linear"
model = { box = { size_m = [0.4, 0.4, 0.4], bevel_m = 0.1, triangle_m = 0.2 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [3.4, 1, 0.3] }
[[bodies]]
name = "veil"
role = "scenery"
model = { box = { size_m = [0.1, 0.1, 0.1] } }
pose = { position_m = [3.4, 1, 1.3] }
[goal]
center_of_mass_m = [3.2, 1, 1.2]
radius_m = 0.3
shape = { angle_deg = 10, turn_tolerance_deg = 20, tolerance_m = 0.5 }
[planner]
preset = "fast"
max_force_n = 100
[film]
frames_per_second = 5
size_px = [96, 64]
color_by = "strain"
color_range = [0, 0.1]
[[cameras]]
name = "side"
[camera]
)";
constexpr const char* part =
    "bodies.block.parts=[{ box_m = [[0, 0, 0], [4, 2, 0.3]], youngs_modulus_pa = 6e3, density_kg_m3 = 90 }]";
constexpr const char* one_via = "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3 }]";
constexpr const char* keyed = "camera.keyframes=[{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 1] }]";
constexpr const char* side_keyed =
    "cameras=[{ name = \"side\", keyframes = [{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 1] }] }]";
constexpr const char* balloon =
    "goal={ center_of_mass_m = [3, 1, 1.2], radius_m = 0.3 }|planner.max_pressure_pa=500|planner.settle_hold="
    "true";
constexpr const char* one_pressure = "pressures=[{ body = \"cart\", to_s = 1, pressure_pa = 100 }]";
constexpr const char* one_force = "forces=[{ body = \"cart\", to_s = 1, force_n = [1, 0, 0] }]";
constexpr const char* one_ligament =
    "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
    "0.45], stiffness_n_m = 40 }]";
constexpr const char* one_motion =
    "bodies.block.kind=rigid|"
    "motions=[{ body = \"block\", keyframes = [{ at_s = 1, position_m = [3, 1, 1] }] }]";
constexpr const char* turning =
    "bodies.block.kind=rigid|motions=[{ body = \"block\", keyframes = [{ at_s = 1, angle_deg = 9 }] }]";
const std::vector<Row> rows{
    {"description", "description=other", nothing},
    {"world.bounds_m", "world.bounds_m=[[0, 0, 0], [4, 2, 3]]", world | film},
    {"world.walls", "world.walls=false", world},
    {"world.gravity_m_s2", "world.gravity_m_s2=[0, 0, -1]", world},
    {"world.rest_speed_m_s", "world.rest_speed_m_s=0.01", world},
    {"world.contact_offset_m", "world.contact_offset_m=0.01", world},
    {"world.part_overlaps", "world.part_overlaps=false", world},
    {"world.max_dt_s", "world.max_dt_s=0.0001", world},
    {"bodies[].pose.position_m", "bodies.cart.pose.position_m=[3.4, 1, 0.32]", world | film},
    {"bodies[].kind", "bodies.cart.kind=rigid", world | film},
    {"bodies[].contact", "bodies.cart.contact=cage", world},
    {"bodies[].deformation", "bodies.cart.deformation=phong", world | film},
    {"bodies[].self_contact", "bodies.cart.self_contact=true", world},
    {"bodies[].max_volume_change", "bodies.cart.max_volume_change=0.2", world},
    {"bodies[].max_stretch", "bodies.cart.max_stretch=3", world},
    {"bodies[].max_contact_load_n", "bodies.cart.max_contact_load_n=300", world},
    {"bodies[].color", "bodies.cart.color=\"#123456\"", film},
    {"bodies[].texture", "bodies.cart.texture=false", film, "film.color_by=body"},
    {"bodies[].opacity", "bodies.veil.opacity=0.5", film},
    {"bodies[].look", "bodies.veil.look=skin", film},
    {"bodies[].roughness", "bodies.veil.roughness=0.6", film},
    {"bodies[].metallic", "bodies.cart.metallic=0.5", film},
    {"bodies[].material.model", "bodies.cart.material.model=neo_hookean", world},
    {"bodies[].material.youngs_modulus_pa", "bodies.cart.material.youngs_modulus_pa=6e3", world},
    {"bodies[].material.poisson_ratio", "bodies.cart.material.poisson_ratio=0.4", world},
    {"bodies[].material.density_kg_m3", "bodies.cart.material.density_kg_m3=90", world},
    {"bodies[].material.damping_ratio", "bodies.cart.material.damping_ratio=0.1", world},
    {"bodies[].material.mass_damping_per_s", "bodies.cart.material.mass_damping_per_s=0.5", world},
    {"bodies[].material.fascia_hz", "bodies.cart.material.fascia_hz=2", world},
    {"bodies[].material.fascia_damping_ratio", "bodies.cart.material.fascia_damping_ratio=0.5", world,
     "bodies.cart.material.fascia_hz=2"},
    {"bodies[].material.friction", "bodies.cart.material.friction=0.3", world},
    {"bodies[].material.mesh_independent", "bodies.cart.material.mesh_independent=false", world},
    {"bodies[].parts[].shell",
     "bodies.block.parts=[{ shell = 0, youngs_modulus_pa = 6e3, density_kg_m3 = 90 }]", world, part},
    {"bodies[].parts[].box_m",
     "bodies.block.parts=[{ box_m = [[0, 0, 0], [4, 2, 2]], youngs_modulus_pa = 6e3, density_kg_m3 = 90 }]",
     world, part},
    {"bodies[].parts[].youngs_modulus_pa",
     "bodies.block.parts=[{ box_m = [[0, 0, 0], [4, 2, 0.3]], youngs_modulus_pa = 7e3, density_kg_m3 = 90 }]",
     world, part},
    {"bodies[].parts[].density_kg_m3",
     "bodies.block.parts=[{ box_m = [[0, 0, 0], [4, 2, 0.3]], youngs_modulus_pa = 6e3, density_kg_m3 = 80 }]",
     world, part},
    {"bodies[].fixed", "bodies.block.fixed=[{ box_m = [[0, 0, 0], [4, 2, 0.1]] }]", world},
    {"bodies[].fixed[].box_m", "bodies.block.fixed=[{ box_m = [[0, 0, 0], [4, 2, 0.4]] }]", world,
     "bodies.block.fixed=[{ box_m = [[0, 0, 0], [4, 2, 0.1]] }]"},
    {"bodies[].velocity_m_s", "bodies.cart.velocity_m_s=[0, 0, 1]", world},
    {"bodies[].angular_velocity_rad_s", "bodies.cart.angular_velocity_rad_s=[0, 0, 1]", world},
    {"bodies[].gravity_m_s2", "bodies.cart.gravity_m_s2=[0, 0, -1]", world},
    {"pressures[].body", "pressures=[{ body = \"robot\", to_s = 1, pressure_pa = 100 }]", world,
     one_pressure},
    {"pressures[].from_s", "pressures=[{ body = \"cart\", from_s = 0.5, to_s = 1, pressure_pa = 100 }]",
     world, one_pressure},
    {"pressures[].to_s", "pressures=[{ body = \"cart\", to_s = 2, pressure_pa = 100 }]", world, one_pressure},
    {"pressures[].pressure_pa", "pressures=[{ body = \"cart\", to_s = 1, pressure_pa = 90 }]", world,
     one_pressure},
    {"forces[].body", "forces=[{ body = \"robot\", to_s = 1, force_n = [1, 0, 0] }]", world, one_force},
    {"forces[].from_s", "forces=[{ body = \"cart\", from_s = 0.5, to_s = 1, force_n = [1, 0, 0] }]", world,
     one_force},
    {"forces[].to_s", "forces=[{ body = \"cart\", to_s = 2, force_n = [1, 0, 0] }]", world, one_force},
    {"forces[].force_n", "forces=[{ body = \"cart\", to_s = 1, force_n = [1, 0, 1] }]", world, one_force},
    {"forces[].box_m",
     "forces=[{ body = \"cart\", to_s = 1, force_n = [1, 0, 0], box_m = [[3, 0, 0], [4, 2, 0.2]] }]", world,
     one_force},
    {"ligaments[].name",
     "ligaments=[{ name = \"other\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40 }]",
     film, one_ligament},
    {"ligaments[].from",
     "ligaments=[{ name = \"band\", from = \"cart\", from_m = [3.4, 1, 0.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40 }]",
     world | film, one_ligament},
    {"ligaments[].from_m",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.4], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40 }]",
     world | film, one_ligament},
    {"ligaments[].to",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to_m = [2, 1, 0.45], "
     "stiffness_n_m = 40 }]",
     world | film, one_ligament},
    {"ligaments[].to_m",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.5], stiffness_n_m = 40 }]",
     world | film, one_ligament},
    {"ligaments[].radius_m",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, radius_m = 0.5 }]",
     world | film, one_ligament},
    {"ligaments[].stiffness_n_m",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 41 }]",
     world, one_ligament},
    {"ligaments[].damping_ratio",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, damping_ratio = 0.4 }]",
     world, one_ligament},
    {"ligaments[].rest_length",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, rest_length = 0.9 }]",
     world, one_ligament},
    {"ligaments[].pushes",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, pushes = true }]",
     world, one_ligament},
    {"ligaments[].diameter_m",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, diameter_m = 0.05 }]",
     film, one_ligament},
    {"ligaments[].color",
     "ligaments=[{ name = \"band\", from = \"robot\", from_m = [0.6, 1, 1.3], to = \"block\", to_m = [2, 1, "
     "0.45], stiffness_n_m = 40, color = \"#112233\" }]",
     film, one_ligament},
    {"motions[].keyframes[].at_s",
     "motions=[{ body = \"block\", keyframes = [{ at_s = 2, position_m = [3, 1, 1] }] }]", world, one_motion},
    {"motions[].keyframes[].position_m",
     "motions=[{ body = \"block\", keyframes = [{ at_s = 1, position_m = [3, 1, 0.9] }] }]", world,
     one_motion},
    {"motions[].keyframes[].axis",
     "motions=[{ body = \"block\", keyframes = [{ at_s = 1, angle_deg = 9, axis = [1, 0, 0] }] }]", world,
     turning},
    {"motions[].keyframes[].angle_deg",
     "motions=[{ body = \"block\", keyframes = [{ at_s = 1, angle_deg = 10 }] }]", world, turning},
    {"goal.center_of_mass_m", "goal.center_of_mass_m=[3.1, 1, 1.2]", search},
    {"goal.radius_m", "goal.radius_m=0.2", search},
    {"goal.moves_with", "goal.moves_with=cart", world, "planner.settle_time_s=0"},
    {"goal.lost_below_m", "goal.lost_below_m=0.05", world, "planner.settle_time_s=0|goal.moves_with=cart"},
    {"goal.above", "goal.above=block", world},
    {"goal.below", "goal.below=block", world},
    {"goal.clear_of", "goal.clear_of=block", world},
    {"goal.volume", "goal.volume=1.2", world | search, balloon},
    {"goal.through", "goal.through=[\"block\"]", world},
    {"goal.shape.axis", "goal.shape.axis=[1, 0, 0]", world},
    {"goal.shape.angle_deg", "goal.shape.angle_deg=20", world},
    {"goal.shape.stretch", "goal.shape.stretch=[1.1, 1, 1]", world},
    {"goal.shape.turn_tolerance_deg", "goal.shape.turn_tolerance_deg=30", world},
    {"goal.shape.tolerance_m", "goal.shape.tolerance_m=0.4", world},
    {"goal.shape.half_turn", "goal.shape.half_turn=[0, 0, 1]", world,
     "planner.weights.interpolation=0|planner.settle_force_share=0"},
    {"via[].center_of_mass_m", "via=[{ center_of_mass_m = [2, 1, 1.4], radius_m = 0.3 }]", search, one_via},
    {"via[].radius_m", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.2 }]", search, one_via},
    {"via[].box_m", "via=[{ center_of_mass_m = [2, 1, 1.5], box_m = [[1.9, 0.9, 1.4], [2.1, 1.1, 1.6]] }]",
     search, one_via},
    {"via[].rest", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, rest = true }]", search, one_via},
    {"via[].moves_with", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, moves_with = \"cart\" }]",
     world, one_via},
    {"via[].above", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, above = \"block\" }]", world,
     one_via},
    {"via[].below", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, below = \"block\" }]", world,
     one_via},
    {"via[].clear_of", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, clear_of = \"block\" }]",
     world, one_via},
    {"via[].through", "via=[{ center_of_mass_m = [2, 1, 1.5], radius_m = 0.3, through = [\"block\"] }]",
     world, one_via},
    {"planner.preset", "planner.preset=paper", search},
    {"planner.seed", "planner.seed=2", search},
    {"planner.iterations", "planner.iterations=900", search},
    {"planner.goal_bias", "planner.goal_bias=0.2", search},
    {"planner.weights.body", "planner.weights.body=0.7", search},
    {"planner.weights.control_point", "planner.weights.control_point=0.4", search},
    {"planner.weights.interpolation", "planner.weights.interpolation=0.2", search},
    {"planner.max_force_n", "planner.max_force_n=90", search},
    {"planner.max_pressure_pa", "planner.max_pressure_pa=500", search},
    {"planner.force_share", "planner.force_share=[0.5, 1]", search},
    {"planner.duration_s", "planner.duration_s=[0.2, 2]", search},
    {"planner.control_point_radius_m", "planner.control_point_radius_m=0.2", search},
    {"planner.patches_m", "planner.patches_m=[[[0, 0, 0], [4, 2, 2]]]", world},
    {"planner.lead", "planner.lead=true", world,
     "planner.patches_m=[[[0, 0, 0], [4, 2, 2]]]|planner.settle_time_s=0|planner.weights.interpolation=0"},
    {"planner.carry", "planner.carry=true", world,
     "planner.patches_m=[[[0, 0, 0], [4, 2, 2]], [[0, 0, 0], [2, 2, 2]]]"},
    {"planner.settle_time_s", "planner.settle_time_s=2", search},
    {"planner.settle_speed_m_s", "planner.settle_speed_m_s=0.03", search},
    {"planner.settle_force_share", "planner.settle_force_share=0.5", search},
    {"planner.lag", "planner.lag=5", search},
    {"planner.metric", "planner.metric=distance", search},
    {"planner.time_weight", "planner.time_weight=0.5", search},
    {"planner.guidance", "planner.guidance=0.5", search},
    {"planner.soft_price", "planner.soft_price=50", search},
    {"planner.density_price", "planner.density_price=1", search},
    {"planner.learn_prices", "planner.learn_prices=false", search},
    {"planner.steer", "planner.steer=false", search},
    {"planner.look_s", "planner.look_s=0.2", search},
    {"planner.stop_in_goal", "planner.stop_in_goal=false", search},
    {"planner.end_hopeless", "planner.end_hopeless=false", search},
    {"planner.shortcut_rounds", "planner.shortcut_rounds=3", nothing},
    {"camera.direction", "camera.direction=[1, 0, 0]", film},
    {"camera.fov_deg", "camera.fov_deg=40", film},
    {"camera.keyframes[].at",
     "camera.keyframes=[{ at = 0.5, eye_m = [0, -5, 1], target_m = [2, 1, 1] }, { at = 1, eye_m = [4, -5, "
     "1], target_m = [2, 1, 1] }]",
     film,
     "camera.keyframes=[{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 1] }, { at = 1, eye_m = [4, -5, 1], "
     "target_m = [2, 1, 1] }]"},
    {"camera.keyframes[].eye_m", "camera.keyframes=[{ at = 0, eye_m = [0, -6, 1], target_m = [2, 1, 1] }]",
     film, keyed},
    {"camera.keyframes[].target_m", "camera.keyframes=[{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 0] }]",
     film, keyed},
    {"camera.turn_deg", "camera.turn_deg=90", film},
    {"camera.follow", "camera.follow=robot", film},
    {"camera.subject", "camera.subject=cart", film},
    {"camera.fill", "camera.fill=0.5", film},
    {"cameras[].direction", "cameras=[{ name = \"side\", direction = [1, 0, 0] }]", film},
    {"cameras[].fov_deg", "cameras=[{ name = \"side\", fov_deg = 40 }]", film},
    {"cameras[].keyframes[].at",
     "cameras=[{ name = \"side\", keyframes = [{ at = 0.5, eye_m = [0, -5, 1], target_m = [2, 1, 1] }, { at "
     "= 1, eye_m = [4, -5, 1], target_m = [2, 1, 1] }] }]",
     film,
     "cameras=[{ name = \"side\", keyframes = [{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 1] }, { at = "
     "1, eye_m = [4, -5, 1], target_m = [2, 1, 1] }] }]"},
    {"cameras[].keyframes[].eye_m",
     "cameras=[{ name = \"side\", keyframes = [{ at = 0, eye_m = [0, -6, 1], target_m = [2, 1, 1] }] }]",
     film, side_keyed},
    {"cameras[].keyframes[].target_m",
     "cameras=[{ name = \"side\", keyframes = [{ at = 0, eye_m = [0, -5, 1], target_m = [2, 1, 0] }] }]",
     film, side_keyed},
    {"cameras[].turn_deg", "cameras=[{ name = \"side\", turn_deg = 90 }]", film},
    {"cameras[].follow", "cameras=[{ name = \"side\", follow = \"robot\" }]", film},
    {"cameras[].subject", "cameras=[{ name = \"side\", subject = \"cart\" }]", film},
    {"cameras[].fill", "cameras=[{ name = \"side\", fill = 0.5 }]", film},
    {"film.frames_per_second", "film.frames_per_second=6", search | film},
    {"film.speed", "film.speed=0.5", search | film},
    {"film.pace", "film.pace=contact", film},
    {"film.length_s", "film.length_s=0.5", film, "film.pace=contact"},
    {"film.look", "film.look=dark", film},
    {"film.outlines", "film.outlines=true", film},
    {"film.labels", "film.labels=true", film},
    {"film.cuts[].point_m", "film.cuts=[{ point_m = [3.42, 1, 1], normal = [1, 0, 0] }]", film,
     "film.cuts=[{ point_m = [3.4, 1, 1], normal = [1, 0, 0] }]"},
    {"film.cuts[].normal", "film.cuts=[{ point_m = [3.4, 1, 1], normal = [1, 1, 0] }]", film,
     "film.cuts=[{ point_m = [3.4, 1, 1], normal = [1, 0, 0] }]"},
    {"film.cuts[].bodies", "film.cuts=[{ point_m = [3.4, 1, 1], normal = [1, 0, 0], bodies = [\"cart\"] }]",
     film, "film.cuts=[{ point_m = [3.4, 1, 1], normal = [1, 0, 0] }]"},
    {"film.inset.camera", "film.inset.camera=side", film, "film.inset={ camera = \"main\" }"},
    {"film.inset.size", "film.inset.size=0.4", film, "film.inset={ camera = \"side\" }"},
    {"film.title.text", "film.title.text=B", film, "film.title={ text = \"A\" }"},
    {"film.title.duration_s", "film.title.duration_s=1", film, "film.title={ text = \"A\" }"},
    {"film.title.ground", "film.title.ground=plain", film, "film.title={ text = \"A\" }"},
    {"film.end_card.text", "film.end_card.text=B", film, "film.end_card={ text = \"A\" }"},
    {"film.end_card.duration_s", "film.end_card.duration_s=1", film, "film.end_card={ text = \"A\" }"},
    {"film.end_card.ground", "film.end_card.ground=plain", film, "film.end_card={ text = \"A\" }"},
    {"film.ground_m", "film.ground_m=-0.5", film},
    {"film.background", "film.background=\"#123456\"", film},
    {"film.bounds_lines", "film.bounds_lines=false", film},
    {"film.transparent", "film.transparent=true", film},
    {"film.caption", "film.caption=words", film},
    {"film.clock", "film.clock=true", film},
    {"film.scale_bar", "film.scale_bar=true", film},
    {"film.color_by", "film.color_by=speed", film},
    {"film.color_range", "film.color_range=[0, 0.2]", film},
    {"film.cages", "film.cages=true", film},
    {"film.forces", "film.forces=true", film},
    {"film.path", "film.path=true", film},
    {"film.tree", "film.tree=true", film},
    {"film.side_by_side", "film.side_by_side=true", film},
    {"film.sheet", "film.sheet=[2, 2]", nothing},
    {"film.size_px", "film.size_px=[64, 64]", film}};

// Keys that have another test, and why.
const std::map<std::string, std::string> elsewhere{
    {"name", "a title"},
    {"bodies[].name", "names a folder"},
    {"bodies[].role", "says which bodies move, and so what a state is: below"},
    {"bodies[].triangles", "of scenery: below"},
    {"motions[].body", "likewise says which bodies move: below"},
    {"cameras[].name", "names a film"},
    {"film.panes", "where a wall is pressed: Story_slow"},
    {"film.pace_range", "where the robot is touched: Story_slow"},
    {"film.end", "says how many frames there are, not what is on them"},
    {"goal.box_m", "instead of radius_m: below"},
    {"goal.shape.cage", "a file: below"},
    {"planner.settle_hold", "without effect where a goal has a shape: below"},
    {"planner.hold", "likewise"}};

std::vector<std::string> sets_of(const char* given, const char* set) {
  std::vector<std::string> sets;
  std::string rest = given;
  for (std::size_t at; !rest.empty(); rest = at == rest.npos ? "" : rest.substr(at + 1)) {
    at = rest.find('|');
    sets.push_back(rest.substr(0, at));
  }
  if (*set) sets.emplace_back(set);
  return sets;
}

TEST(Keys, EachHasItsRow) {
  std::set<std::string> told;
  for (const Row& row : rows) told.insert(row.key);
  for (const MeshRow& row : mesh_rows) told.insert(row.key);
  for (const auto& [key, why] : elsewhere) EXPECT_TRUE(told.insert(key).second) << key << " is told twice";
  for (const scenes::Key& key : scenes::keys()) {
    const std::string path(key.path);
    if (key.type == scenes::Type::table || key.type == scenes::Type::tables) continue;
    EXPECT_EQ(told.erase(path), 1u) << path << " has no row";
  }
  for (const std::string& key : told) ADD_FAILURE() << key << " is no key of a scene";
}

class Keys_slow : public Program {
 protected:
  static SurfaceMesh tetrahedron(double height) {
    SurfaceMesh mesh{Points(4, 3), Triangles(4, 3)};
    mesh.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, height;
    mesh.triangles << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
    return mesh;
  }
  scenes::Scene scene_of(const char* text, const std::vector<std::string>& sets) const {
    scenes::Scene scene = scenes::read_scene(text, "scene", sets);
    scene.folder = folder.path();
    return scene;
  }
};

TEST_F(Keys_slow, OfAMeshChangeTheIdentityOfThatBodyAlone) {
  ::setenv("LIMBER_MODELS", folder.path().c_str(), 1);
  write_obj(folder / "one.obj", tetrahedron(1)), write_obj(folder / "two.obj", tetrahedron(2));
  for (const MeshRow& row : mesh_rows) {
    SCOPED_TRACE(row.set);
    const scenes::Scene before = scene_of(models, sets_of(row.given, "")),
                        after = scene_of(models, sets_of(row.given, row.set));
    for (std::size_t b = 0; b < before.bodies.size(); ++b)
      EXPECT_EQ(identity_of(before, before.bodies[b], {}) != identity_of(after, after.bodies[b], {}),
                before.bodies[b].name == row.body)
          << before.bodies[b].name;
  }
}

TEST_F(Keys_slow, ChangeWhatTheyShapeAndNothingElse) {
  const std::string file = scene(stage);
  ASSERT_EQ(limber_program({"plan", file, "-o", out(), "--iterations", "3", "-q"}).code, exit_no_plan);
  const PlanFolder planned = read_plan_folder(out());
  std::vector<PreparedBody> prepared = read_world_of(planned, out()).bodies;
  Appearance& of_cart = prepared[2].appearance;  // as if its model had a color of its own
  of_cart.material_from_triangle.assign(std::size_t(prepared[2].surface.triangles.rows()), 0);
  of_cart.materials = {{.name = "green", .color = Vec3(0, 1, 0)}};
  const std::vector<SurfaceMesh> scenery = read_scenery(planned.scene, out());
  struct Identities {
    std::vector<Json> bodies;
    std::uint64_t world;
    Json search;
    std::vector<std::string> film;
  };
  const auto identities_of = [&](const std::vector<std::string>& sets) {
    const scenes::Scene scene = scene_of(stage, sets);
    Identities all;
    for (const scenes::BodySpec& body : scene.bodies) all.bodies.push_back(identity_of(scene, body, {}));
    std::vector<PreparedBody> bodies;
    for (std::size_t b = 0; b < prepared.size(); ++b) {
      bodies.push_back(read_body(body_folder(out(), scene.bodies[b])));
      bodies[b].deformation = scene.bodies[b].deformation, bodies[b].appearance = prepared[b].appearance;
      place(bodies[b], scene.bodies[b].pose.position_m);
    }
    const fem::World w = build_world(scene, bodies);
    all.world = FemSystem(w, goal_rules_of(scene)).hash();
    all.search = plan::json_of(settings_of(scene, {}));
    for (const scenes::CameraSpec& camera : scene.cameras) {
      const Shot shot(scene, camera.name, planned.plan, w, bodies, scenery,
                      {scene.film.width_px, scene.film.height_px});
      for (int f = 0; f < shot.frames(); ++f) all.film.push_back(shot.hash_of(f));
    }
    return all;
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.set);
    const Identities before = identities_of(sets_of(row.given, "")),
                     after = identities_of(sets_of(row.given, row.set));
    EXPECT_EQ(before.bodies, after.bodies);
    EXPECT_EQ(before.world != after.world, bool(row.shapes & world));
    EXPECT_EQ(before.search != after.search, bool(row.shapes & search));
    EXPECT_EQ(before.film != after.film, bool(row.shapes & film));
  }

  // A rigid body that is free moves, one that is an obstacle does not.
  const auto hash_of_world = [&](const std::vector<std::string>& sets) {
    const scenes::Scene scene = scene_of(stage, sets);
    const fem::World w = build_world(scene, prepared);
    return FemSystem(w, goal_rules_of(scene)).hash();
  };
  EXPECT_NE(hash_of_world({"bodies.cart.kind=rigid"}),
            hash_of_world({"bodies.cart.kind=rigid", "bodies.cart.role=obstacle"}));

  const auto hash_with_motion_of = [&](const char* body) {
    return hash_of_world(
        {"bodies.block.kind=rigid", "bodies.cart.kind=rigid", "bodies.cart.role=obstacle",
         fmt::format("motions=[{{ body = \"{}\", keyframes = [{{ at_s = 1, angle_deg = 9 }}] }}]", body)});
  };
  EXPECT_NE(hash_with_motion_of("block"), hash_with_motion_of("cart"));

  // Those that go with others, or without.
  const auto text_of_stage = [](const char* from, const char* to) {
    std::string text = stage;
    return text.replace(text.find(from), std::string(from).size(), to);
  };
  const auto search_of = [&](const std::string& text) {
    return plan::json_of(settings_of(scenes::read_scene(text, "scene"), {}));
  };
  EXPECT_NE(search_of(text_of_stage("radius_m = 0.3\n", "box_m = [[3, 0.8, 1], [3.4, 1.2, 1.4]]\n")),
            search_of(stage));
  const std::string no_shape = "shape = { angle_deg = 10, turn_tolerance_deg = 20, tolerance_m = 0.5 }\n";
  for (const char* key : {"hold", "settle_hold"}) {
    const std::string without = text_of_stage(no_shape.c_str(), "");
    std::string with = without;
    with.replace(with.find("preset = "), 0, fmt::format("{} = false\n", key));
    EXPECT_NE(search_of(with), search_of(without)) << key;
  }
}

// The goal's shape node by node: what is in the file counts, and the plan knows it wherever its folder goes.
TEST_F(Keys_slow, AGoalsCageGoesWithThePlan) {
  const std::string text =
      std::string(stage).replace(std::string(stage).find("angle_deg = 10, "), 16, "cage = \"goal.msh\", ");
  ASSERT_NE(limber_program({"plan", scene(stage), "-o", out(), "--iterations", "0"}).code, exit_bad_input);
  TetMesh cage = read_msh(fs::path(out()) / "bodies" / "robot" / "cage.msh");
  const auto hash_with = [&](double stretch) {
    TetMesh changed = cage;
    changed.positions.col(0) *= stretch;
    write_msh(folder / "goal.msh", changed);
    EXPECT_EQ(limber_program({"plan", scene(text), "-o", out(), "--iterations", "0"}).code, exit_no_plan);
    return read_plan_folder(out()).plan.system_hash;
  };
  EXPECT_NE(hash_with(1), hash_with(1.1));
  // The numbers of its nodes are the robot's; the order of its tets is free.
  MeshOrder order = shuffled_order(cage, 17);
  write_msh(folder / "goal.msh", reordered(cage, order));
  const Result renumbered = limber_program({"plan", scene(text), "-o", out(), "--iterations", "0"});
  EXPECT_EQ(renumbered.code, exit_bad_input);
  EXPECT_THAT(renumbered.err, testing::HasSubstr("numbered anew"));
  std::iota(order.node_from_place.begin(), order.node_from_place.end(), 0);
  cage = reordered(cage, order);
  hash_with(1.1);
  fs::remove(folder / "goal.msh");
  const Json verified = limber_program({"verify", out(), "--json"}).json();
  bool same_world = false;
  for (const Json& row : verified.at("promises"))
    same_world = same_world || (row.at("promise") == "the plan is of this world" && row.at("kept"));
  EXPECT_TRUE(same_world);
}

// Scenery is simplified to what is asked for, anew when that changes.
TEST_F(Keys_slow, SceneryIsMadeAnewWhereItsTrianglesChange) {
  const auto triangles = [&](const std::string& set) {
    limber_program({"plan", scene(stage), "-o", out(), "--iterations", "0", "--set", set});
    return read_ply(fs::path(out()) / "scenery" / "veil.ply").triangles.rows();
  };
  EXPECT_GT(triangles("bodies.veil.triangles=1000"), triangles("bodies.veil.triangles=200"));
}

}  // namespace
}  // namespace limber::detail
