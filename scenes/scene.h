// The scene that the user wrote (TOML), as plain numbers in SI units, checked: who reads a Scene need not
// check again. Every key with its unit, default and range: docs/scene.md, which is generated from the
// reader's own table.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/file.h"
#include "core/mesh.h"

namespace limber::scenes {

enum class Role { robot, obstacle, free, scenery };
enum class Contact { surface, cage };  // where a body is touched
enum class Kind {
  deformable,
  rigid
};  // a rigid obstacle does not move; other rigid bodies move as one piece

// A model file, brought to our axes (z up, x to the front) and to metres; its own origin is kept.
struct FileModel {
  std::string file;                // looked for as find_model() says
  std::string made;                // fall-back where the file cannot be had, as MadeModel::made; empty: none
  double scale = 1;                // metres a file unit, > 0; not used when height_m is given
  std::optional<double> height_m;  // > 0: scaled so that the turned model is this high
  Vec3 up = Vec3::UnitZ();         // the file's axis that points up, and the one that points to the front
  Vec3 front = Vec3::UnitX();
};
struct MadeModel {   // its origin is the middle of its bounding box
  std::string made;  // "beach_ball", "bunny", "dragon", "heart", "lung_left", … as the schema has them
  double height_m = 1;
};
struct BoxModel {  // its origin is its middle
  Vec3 size_m = Vec3::Ones();
  double bevel_m = 0;     // radius of the rounded edges; at most half the smallest size
  double triangle_m = 0;  // longest edge of a triangle on a flat face, > 0
};
struct Hole {
  bool round = true;  // else square
  double size_m = 0;  // diameter, or side of the square
  // From the plate's middle, along its two longer axes in the order x, y, z.
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();
};
struct PlateModel {  // a box with a hole along its thinnest axis; its origin is its middle
  BoxModel box;
  std::optional<Hole> hole;
};
struct SphereModel {  // its origin is its centre
  double diameter_m = 1;
  double triangle_m = 0;
};
struct BlocksModel {  // all that is in a solid and in no hole; its origin is that of these boxes' coordinates
  std::vector<Box> solids, holes;
  double bevel_m = 0;
  double triangle_m = 0;
};
struct TubeModel {  // along a smooth curve through points; its origin is that of their coordinates
  std::vector<Vec3> path_m;
  double diameter_m = 0;  // outer
  double wall_m = 0;      // 0: a rod, with half a ball at each end
  double triangle_m = 0;
};
using Model = std::variant<FileModel, MadeModel, BoxModel, PlateModel, SphereModel, BlocksModel, TubeModel>;

struct CageSpec {
  int tets = 0;      // budget of the enclosing cage; 0 when cells or cell_m are given
  std::string mode;  // "lattice", "fast", "paper" or "conform": how that cage is made
  int shells = 0;    // at most so many convex shells; 0: none, for nothing reads them
  // Boxes and plates without a hole: cut into nx × ny × nz cells of five tets each.
  Eigen::Vector3i cells = Eigen::Vector3i::Zero();
  double cell_m = 0;  // blocks: longest edge of a cell; 0: not given
};

struct MaterialSpec {
  std::string model;  // "springs" or "neo_hookean"
  double youngs_modulus_pa = 0, poisson_ratio = 0, density_kg_m3 = 0, damping_ratio = 0, friction = 0;
  double mass_damping_per_s = 0;
  double fascia_hz = 0, fascia_damping_ratio = 1;  // what draws each node to its place; 0: nothing
  bool mesh_independent = true;                    // what the cage's tets are too stiff is taken off
};

// What differs from the material in part of a body.
struct PartSpec {
  std::optional<int>
      shell;  // the tets of this convex shell, as `limber info` and shells.obj number them; else
  Box box_m;  // the tets with their middle in this box, in world coordinates at the start
  std::optional<double> youngs_modulus_pa, density_kg_m3;  // one at least
  std::string where;                                       // its place in the text, for complaints
};

struct Pose {
  Vec3 position_m = Vec3::Zero();  // where the anchor of the turned model goes
  Vec3 axis = Vec3::UnitZ();       // unit
  double angle_deg = 0;
  std::string anchor;  // "origin", "center" of the bounding box, or "bottom": the middle of its lower face
};

// Which nodes of the cage are held where they are.
struct FixedSpec {
  bool walls = false;        // all that lie on a wall of the bounds
  std::vector<Box> boxes_m;  // all that lie in one of these boxes, in world coordinates at the start
};

// How the fine surface follows the nodes of its cage: docs/binding.md.
enum class Deformation { linear, phong };

// Of soft bodies that are touched at their surface, where the scene does not say; and what is no limit.
constexpr double usual_max_stretch = 2, any_stretch = 1000;

// What a body's surface is of, and the light it is filmed in: docs/rendering.md.
enum class BodyLook { plain, rubber, tissue, bone, fabric, skin };
enum class FilmLook { studio, dark, clinical, paper };
// How time goes in films, and when they end: docs/rendering.md, "Time".
enum class Pace { steady, contact };
enum class FilmEnd { path, rest };

struct BodySpec {
  std::string name;  // letters, digits, _ and -: it names a folder
  Role role = Role::obstacle;
  Kind kind = Kind::deformable;
  Contact contact = Contact::surface;
  std::optional<bool>
      self_contact;  // parts of it push one another apart; nothing: wherever it can reach itself
  Deformation deformation = Deformation::linear;
  double max_volume_change = 0.1;  // |V − V0|/V0 in all states of a plan, in (0, 1]
  // > 1: the body stiffens towards tets whose singular values are outside of 1/s and s, and in all states of
  // a plan they are within. Nothing, or any_stretch: no limit.
  std::optional<double> max_stretch;
  std::optional<double>
      max_contact_load_n;  // > 0; what presses it in all frames of a plan; nothing: no limit
  Model model;
  CageSpec cage;
  MaterialSpec
      material;  // of a rigid body friction and, where it moves, density count; the rest is filled in
  std::vector<PartSpec> parts;  // a later one rules where two meet
  Pose pose;
  FixedSpec fixed;
  Vec3 velocity_m_s = Vec3::Zero(), angular_velocity_rad_s = Vec3::Zero();  // at the start
  std::optional<Vec3> gravity_m_s2;                                         // nothing: the world's
  Vec3 color_srgb = Vec3::Zero();                                           // 0 … 1
  bool texture = true;  // the model's own colors are shown, where it has some
  BodyLook look = BodyLook::plain;
  double opacity = 1, roughness = 0.45, metallic = 0;
  int triangles = 0;  // scenery: its surface is simplified to about so many; 0: as it is
  std::string where;  // "scene.toml:12:24": its place in the text, for complaints
};

// A force that acts on a body between two times.
struct ForceSpec {
  int body = -1;
  double from_s = 0, to_s = 0;  // from < to
  Vec3 force_n = Vec3::Zero();  // on all of the body, or of what is in the box, together
  std::optional<Box> box_m;     // the nodes of the cage that are in it at the start
  std::string where;            // its place in the text, for complaints
};

// A pressure in a soft body between two times, which blows it up.
struct PressureSpec {
  int body = -1;
  double from_s = 0, to_s = 0;  // from < to
  double pressure_pa = 0;       // on the surface of its cage, or, where that is hollow, in the hollow
  std::string where;            // its place in the text, for complaints
};

// A rigid obstacle goes from keyframe to keyframe; at 0 s it is where its pose has it.
struct MotionSpec {
  struct Keyframe {
    double at_s = 0;                 // > 0, ascending
    Vec3 position_m = Vec3::Zero();  // of its anchor
    Vec3 axis = Vec3::UnitZ();       // unit
    double angle_deg = 0;            // about that axis, through the anchor, from its pose
  };
  int body = -1;
  std::vector<Keyframe> keyframes;
  std::string where;
};

// A spring from a point of one body to one of another, or of the world.
struct LigamentSpec {
  std::string name;
  int from = -1, to = -1;  // bodies; `to` −1: the world
  Vec3 from_m = Vec3::Zero(), to_m = Vec3::Zero();
  double radius_m = 0;  // of the cages' nodes that share the pull; 0: those round the point alone
  double stiffness_n_m = 0, damping_ratio = 0;
  double rest_length = 1;  // of its length at the start
  bool pushes = false;
  std::optional<double> diameter_m;  // as it is drawn; nothing: by its length
  Vec3 color_srgb = Vec3::Zero();
  std::string where;
};

struct Goal {
  Vec3 center_of_mass_m = Vec3::Zero();
  int moves_with = -1;  // index of the body whose centre of mass takes the goal along; −1: none
  std::optional<double>
      lost_below_m;     // the goal is lost once the lowest node of that body is below this height
  double radius_m = 0;  // of a ball that holds box_m, when that is given
  std::optional<Box> box_m;
  // What the robot must be besides: turned so, in this shape, higher or lower than a body, not touching one.
  struct Shape {
    Vec3 axis = Vec3::UnitZ();
    double angle_deg = 0;
    Vec3 stretch = Vec3::Ones();  // of the rest shape along x, y, z, before the turn
    std::string cage;             // or a .msh file with the robot's cage as it shall be; empty: none
    std::optional<double> turn_tolerance_deg, tolerance_m;
    std::optional<Vec3> half_turn;  // a unit axis: turned about it by half a turn from there it is as good
  };
  std::optional<Shape> shape;
  int above = -1, below = -1, clear_of = -1;  // indices of bodies; −1: none
  double volume = 0;           // > 0: the robot's cage holds at least so many times what it does at rest
  std::map<int, int> through;  // so many pieces of the robot are in the hole of this body
};
struct Via {
  Goal goal;          // without lost_below_m, shape and volume
  bool rest = false;  // the robot comes to rest in it before it goes on
};

struct PlannerSpec {
  std::string preset;  // "paper" or "fast"; decides the defaults of the others
  std::int64_t seed = 0;
  int iterations = 0;
  double goal_bias = 0;  // share of the iterations that aim at the goal
  // How often each manipulation is chosen, relative to the others; ≥ 0, body or control_point > 0.
  double weight_body = 0, weight_control_point = 0, weight_interpolation = 0;
  double max_force_n = 0;                           // on the whole robot
  double min_force_share = 0, max_force_share = 0;  // of max_force_n, drawn evenly between
  double max_pressure_pa = 0;                       // > 0: the robot is a balloon, blown up by so much
  double min_duration_s = 0, max_duration_s = 0;    // one manipulation is held so long, drawn evenly between
  double control_point_radius_m = 0;
  // Where control points are, in world coordinates at the start; empty: at any node. With `lead` the first is
  // where the robot is taken to be.
  std::vector<Box> patches_m;
  bool lead = false;
  bool carry = false;             // the first two are carriers, which push both at once
  std::string patches_where;      // their place in the text, for complaints
  double settle_time_s = 0;       // the robot gets at most so long to come to rest at the goal,
  double settle_speed_m_s = 0;    // which it does when its mean speed is below this
  double settle_force_share = 0;  // of max_force_n: the largest force of the settle
  bool settle_hold = false;       // it may rest in any turn and shape
  // What the preset `fast` adds; plan/settings.h and docs/planning.md say what they do.
  int lag = 0;
  std::string metric;  // "distance" or "time_to_go"
  double time_weight = 0, guidance = 0, soft_price = 0, density_price = 0, look_s = 0;
  bool learn_prices = false, steer = false, stop_in_goal = false, hold = false, end_hopeless = false;

  int shortcut_rounds = 0;  // of sixteen changes to the path that was found
};

struct Keyframe {
  double at = 0;  // share of the film, 0 … 1, ascending
  Vec3 eye_m = Vec3::Zero(), target_m = Vec3::Zero();
};
struct CameraSpec {
  std::string name = "main";
  Vec3 direction = Vec3::UnitX();   // unit; from the scene to the camera
  double fov_deg = 0;               // vertical
  std::vector<Keyframe> keyframes;  // none: framed automatically from `direction`
  double turn_deg = 0;              // over the film, round the target, counter-clockwise from above
  int follow = -1;                  // index of the body that it goes along with; −1: none
  std::vector<int> subjects;        // indices of the bodies whose motion is framed; none: all
  double fill = 0;                  // share of the picture that what is framed takes up, one way or the other
};

// What the colours of the bodies mean.
enum class ColorBy { body, strain, volume, penetration, speed };

// A second camera's picture in a corner.
struct InsetSpec {
  std::string camera;
  double size = 0.3;  // of the film's width
};

// Words before or after the motion.
struct CardSpec {
  std::vector<std::string> lines;  // UTF-8; the first is set larger
  double duration_s = 0;
  bool plain = false;  // on a plain ground, instead of the first or last picture, blurred
};

// Words beside a body, with a line to it.
struct LabelSpec {
  int body = -1;  // of bodies and, after those, of scenery
  std::string text;
};

// A plane that opens bodies in the picture.
struct CutSpec {
  Vec3 point_m = Vec3::Zero();
  Vec3 normal = Vec3::UnitX();  // unit; what lies on its side is taken away
  std::vector<int> bodies;      // of bodies and, after those, of scenery
};
constexpr int max_cuts = 6;

struct FilmSpec {
  int width_px = 0, height_px = 0;
  int frames_per_second = 0;
  double speed = 1;  // a second of film shows so many of the motion
  Pace pace = Pace::steady;
  double slowest = 1, quickest = 1;  // of the pace contact, times speed
  std::optional<double> length_s;    // of the pace contact
  FilmEnd end = FilmEnd::path;
  FilmLook look = FilmLook::studio;
  std::optional<Vec3> background_srgb;  // nothing: the look's
  std::optional<double> ground_m;       // height; nothing: the bounds' floor, or the lowest of the scenery
  bool bounds_lines = true;             // draw the edges of the bounds as pale lines
  bool transparent = false;             // neither ground nor background
  std::string caption;                  // UTF-8
  bool clock = false, scale_bar = false;
  ColorBy color_by = ColorBy::body;
  std::optional<Eigen::Vector2d> color_range;  // nothing: over the whole motion
  bool cages = false, forces = false, path = false, tree = false, side_by_side = false;
  bool panes = false;     // where bodies touch walls that are not drawn
  bool outlines = false;  // silhouettes and creases as dark lines
  std::vector<LabelSpec> labels;
  std::vector<CutSpec> cuts;
  std::optional<InsetSpec> inset;
  std::optional<CardSpec> title, end_card;
  int sheet_columns = 0, sheet_rows = 0;
};

// More [[forces]], [[pressures]] and [[motions]], in a file of their own.
struct ScriptText {
  std::string text, name_for_messages;
  bool operator==(const ScriptText&) const = default;
};

struct Scene {
  std::string name, description;
  Box bounds_m;
  bool walls = true;  // the bounds are closed by rigid walls
  Vec3 gravity_m_s2 = Vec3::Zero();
  double rest_speed_m_s = 0;
  std::optional<double> contact_offset_m;  // surfaces that near push each other
  bool part_overlaps = true;               // surfaces that overlap at the start are parted, else refused
  std::optional<double> max_dt_s;          // only ever lowers the automatic time step
  std::vector<BodySpec> bodies;
  std::vector<ForceSpec> forces;
  std::vector<PressureSpec> pressures;
  std::vector<MotionSpec> motions;  // of one body each
  std::vector<LigamentSpec> ligaments;
  // Index of the one body whose role is robot; of a scene without, the first that can be pushed: shares of
  // "the robot's size" are of its.
  int robot = -1;
  std::string lacks;     // what it would need to be planned, as a complaint; empty: nothing
  std::vector<Via> via;  // goals that are reached before the last, in this order
  Goal goal;
  PlannerSpec planner;
  std::vector<BodySpec> scenery;    // seen, but no part of the world; only names, models, poses and looks
  std::vector<CameraSpec> cameras;  // the first is `camera`, called main
  FilmSpec film;

  fs::path folder;   // where the scene file lies; empty when the text came from elsewhere
  std::string text;  // as the user wrote it
  std::vector<std::string>
      sets;           // the edits made to it; read_scene(text, …, sets, script) gives this scene again
  ScriptText script;  // what came with it
};

// `sets` are edits "a.b.c=value" made before the text is checked; bodies.robot.x addresses a body by its
// name, and bodies.robot.friction is short for bodies.robot.material.friction. A value that is not TOML is
// taken as a text. What `script` holds follows the scene's own lists. Throws InputError "NAME:line:column:
// what; what to try" with the first complaint.
inline constexpr std::uintmax_t max_scene_bytes = 16 << 20;
Scene read_scene(const std::string& text, const std::string& name_for_messages,
                 const std::vector<std::string>& sets = {}, const ScriptText& script = {});
// `script` is a file, or empty.
Scene read_scene_file(const fs::path&, const std::vector<std::string>& sets = {},
                      const fs::path& script = {});

// Whether all keys have the same values, defaults included, whoever wrote them, text or edits; both with the
// script of the first.
bool say_the_same(const Scene&, const Scene&);

// Throws InputError where the scene can be simulated only: it has no goal.
void require_plannable(const Scene&);

// "+x" … "-z" as a unit vector.
Vec3 axis_named(const std::string&);

// The reference of all keys, in Markdown: what docs/scene.md holds.
std::string scene_reference();

}  // namespace limber::scenes
