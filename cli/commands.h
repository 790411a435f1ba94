// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include <optional>
#include <string>

#include "core/job.h"
#include "core/json.h"
#include "limber/authoring.h"
#include "limber/batch.h"
#include "limber/bench.h"
#include "limber/body_folder.h"
#include "limber/exit_codes.h"
#include "limber/farm.h"
#include "limber/film.h"
#include "limber/motion.h"
#include "limber/robust.h"
#include "limber/work_folder.h"

namespace limber::cli {

struct Outcome {
  int exit_code = exit_done;
  Json json;         // what --json prints
  std::string text;  // what is printed otherwise
};

// `format`: of a model on stdin, the ending that its file would have.
Outcome prepare(ModelOptions, const std::string& format = {});
Outcome prepare_many(const BatchOptions&);
Outcome prepare_scene(const ScenePrepareOptions&);

Outcome plan(const PlanOptions&);
Outcome simulate(const SimulateOptions&);
Outcome refine(const RefineOptions&);
Outcome render(const fs::path& folder, const FilmOptions&);
// plan and render; what is up to date is skipped.
Outcome run(const PlanOptions&, const FilmOptions&);
Outcome export_motion(const ExportOptions&);
Outcome export_body(const BodyExportOptions&);

Outcome verify(const VerifyOptions&);
Outcome robust(const RobustOptions&);
Outcome report(const fs::path& folder, const std::optional<fs::path>& file = {});
Outcome bench(const BenchOptions&);

// Of engine "local" the exit code is that of what ran, else 0.
Outcome farm_submit(const FarmOptions&);
Outcome farm_status(const fs::path& folder);
Outcome farm_cancel(const fs::path& folder);
Outcome farm_work(const WorkOptions&);

Outcome new_scene(const NewSceneOptions&);
// Exit code 2, with all that is wrong, where it cannot even be simulated.
Outcome check_scene(const SceneCheckOptions&);
Outcome render_still(const StillOptions&);
Outcome write_storyboard(const StoryboardOptions&);
// Makes it anew whenever the scene, a model, or an image of one is edited, and prints its name; what is wrong
// with an edit is told, and waited for. Ends by Interrupted alone, or when the picture cannot be written.
Outcome watch_still(StillOptions);
Outcome info(const fs::path& path);
Outcome list_scenes();

}  // namespace limber::cli
