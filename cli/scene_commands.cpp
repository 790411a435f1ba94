// What deals with scenes as such: scene new, scene prepare, scene check, and scenes, which lists those that
// come with limber. scene prepare does what plan and run do first, so that several machines can share the
// bodies of one scene; scene check says what can be said before a search.
#include <CLI/CLI.hpp>

#include <map>
#include <string>
#include <tuple>

#include "cli/described_commands.h"

namespace limber::cli {

namespace {

const std::map<std::string, Story> stories{
    {"away", Story::away},           {"aside", Story::aside},     {"instrument", Story::instrument},
    {"endoscope", Story::endoscope}, {"balloon", Story::balloon}, {"tour", Story::tour}};

}  // namespace

void DescribedCommands::add_scene_commands() {
  CLI::App& scene_command = *program.add_subcommand("scene", "makes scene files, and checks them");
  scene_command.require_subcommand(1);
  CLI::App& new_command = *scene_command.add_subcommand(
      "new", "a scene to begin with, from models in one frame, a scan or an atlas");
  new_command
      .add_option("--from", new_options.from,
                  "folder of models, as heart.obj, lung_left.obj, skin.obj; or a label map (NIfTI, NRRD); or "
                  "BodyParts3D's folder with its tables")
      ->required()
      ->type_name("DIR|FILE")
      ->check(CLI::ExistingPath);
  new_command
      .add_option("--labels", new_options.labels,
                  "names of the label map's labels: a JSON file, {\"5\": \"liver\"} or {\"liver\": 5}")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  add_label_surfaces(new_command, new_options.label_gap, new_options.label_rounds, new_options.min_island);
  new_command.add_option("-o,--out", new_options.out, "scene file to write")->required()->type_name("FILE");
  new_command.add_option("--robot", new_options.robot, "the model that the scene is about")
      ->required()
      ->type_name("NAME");
  new_command
      .add_option_function<std::string>(
          "--story", [&](const std::string& word) { new_options.story = stories.at(word); },
          "away: it moves away, past all that lies that way; aside: it is moved aside; instrument, "
          "endoscope, "
          "balloon: one comes to it, a rigid rod, a soft one, or a balloon that is blown up there; tour: "
          "nothing moves but the cameras; default: away")
      ->check(CLI::IsMember(stories))
      ->type_name("STORY");
  const auto names = [&](const char* flag, std::vector<std::string>& list, const char* meaning) {
    new_command.add_option(flag, list, meaning)
        ->type_name("NAME[,NAME…]")
        ->delimiter(',')
        ->allow_extra_args(false);
  };
  names("--only", new_options.only, "take these models alone (of an atlas: names or FMA ids); default: all");
  names("--see-through", new_options.see_through,
        "only seen, and seen through, besides those called skin, body, ribcage");
  names("--rigid", new_options.rigid,
        "bones, besides those called spine, rib, skull, vertebra, femur, … (docs/imaging.md)");
  new_command.add_option("--scale", new_options.scale, "metres a file unit, 1e-9 … 1e9")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  new_command
      .add_option("--shrink", new_options.shrink,
                  "largest share of its true size that an organ may have, 0.3 … 1; as much less as it takes "
                  "to part them")
      ->check(within(0.3, 1.0))
      ->capture_default_str();
  new_command
      .add_option(
          "--fascia", new_options.fascia_hz,
          "gravity, and soft organs hung in their places by what surrounds them, 1 … 30 Hz (12: they sag by "
          "1.7 mm); default: no gravity, and organs held at their backs")
      ->check(within(1.0, 30.0))
      ->type_name("HZ");
  new_command
      .add_option("--goal", new_options.goal,
                  "where the robot goes: front, back, left, right (the body's), up, down; default: front, or "
                  "aside to where least is in its way")
      ->check(CLI::IsMember({"front", "back", "left", "right", "up", "down"}));
  new_command
      .add_option("--tets", new_options.tets, "of each soft cage, about; 60 … 20000; more fit more closely")
      ->check(CLI::Range(60, 20000))
      ->capture_default_str();
  for (const auto& [flag, axis, meaning] :
       {std::tuple("--up", &new_options.up, "the models' axis that points up"),
        {"--front", &new_options.front, "and to the front"}})
    new_command.add_option(flag, *axis, meaning)
        ->check(CLI::IsMember({"+x", "-x", "+y", "-y", "+z", "-z"}))
        ->capture_default_str();
  add_global(new_command, global);
  new_command.callback([&] { chosen = [&] { return cli::new_scene(new_options); }; });

  CLI::App& scene_prepare_command = *scene_command.add_subcommand(
      "prepare", "the bodies of a scene in its work folder, as plan and run would make them first");
  add_scene(scene_prepare_command, scene_prepare_options.scene);
  scene_prepare_command
      .add_option("-o,--out", scene_prepare_options.out, "work folder; it is made where it is missing")
      ->required()
      ->type_name("DIR");
  scene_prepare_command
      .add_option("--body", scene_prepare_options.bodies,
                  "these alone, as one of several machines that share the folder; default: all, and scenery")
      ->type_name("NAME[,NAME…]")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_global(scene_prepare_command, global), add_threads(scene_prepare_command, global);
  scene_prepare_command.callback([&] { chosen = [&] { return cli::prepare_scene(scene_prepare_options); }; });

  CLI::App& check_command = *scene_command.add_subcommand(
      "check", "loads a scene and its models, and says what can be said before it is planned");
  add_scene(check_command, check_options.scene);
  check_command.add_option("--preset", check_options.preset, "as of limber plan; default: the scene's")
      ->check(CLI::IsMember({"paper", "fast"}));
  check_command
      .add_option("--work", check_options.work,
                  "also prepare the bodies in this work folder (limber plan -o DIR finds them there), build "
                  "their world, and try a search of at most 64 iterations and 10 s")
      ->type_name("DIR");
  check_command.add_option("-o,--still", check_options.still, "paint the start into this file")
      ->type_name("FILE.png");
  check_command.add_option("--camera", check_options.camera, "of the still, one of the scene's cameras")
      ->capture_default_str();
  check_command
      .add_option("--size", check_options.size,
                  "pixels of the still, 16x16 … 8192x8192; default: the scene's")
      ->type_name("WxH");
  add_global(check_command, global), add_threads(check_command, global);
  check_command.callback([&] { chosen = [&] { return cli::check_scene(check_options); }; });

  CLI::App& scenes_command = *program.add_subcommand("scenes", "the scenes that come with limber");
  add_global(scenes_command, global);
  scenes_command.callback([&] { chosen = [] { return list_scenes(); }; });
}

}  // namespace limber::cli
