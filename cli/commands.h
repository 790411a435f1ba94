// The subcommands of the program, each as a function from its options to what it prints.
#pragma once

#include <optional>
#include <string>

#include "core/job.h"
#include "core/json.h"
#include "limber/batch.h"
#include "limber/bench.h"
#include "limber/detail/authoring/new_scene.h"
#include "limber/detail/authoring/scene_check.h"
#include "limber/detail/exports/export_motion.h"
#include "limber/detail/farm/farm_folder.h"
#include "limber/detail/farm/work.h"
#include "limber/detail/film/render.h"
#include "limber/detail/film/start.h"
#include "limber/detail/film/storyboard.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/plan/refine.h"
#include "limber/detail/plan/simulate.h"
#include "limber/detail/verify/robustness.h"
#include "limber/detail/verify/verify.h"
#include "limber/detail/world/prepare_scene.h"
#include "limber/exit_codes.h"

namespace limber::cli {

struct Outcome {
  int exit_code = exit_done;
  Json json;         // what --json prints
  std::string text;  // what is printed otherwise
};

// `format`: of a model on stdin, the ending that its file would have.
Outcome prepare(ModelOptions, const std::string& format = {});
Outcome prepare_many(const BatchOptions&);
Outcome prepare_scene(const detail::ScenePrepareOptions&);

Outcome plan(const detail::PlanOptions&);
Outcome simulate(const detail::SimulateOptions&);
Outcome refine(const detail::RefineOptions&);
Outcome render(const detail::RenderOptions&);
// plan and render; what is up to date is skipped.
Outcome run(const detail::PlanOptions&, const detail::RenderOptions&);
Outcome export_motion(const detail::ExportOptions&);
Outcome export_body(const BodyExportOptions&);

Outcome verify(const detail::VerifyOptions&);
Outcome robust(const detail::RobustOptions&);
Outcome report(const fs::path& folder, const std::optional<fs::path>& file = {});
Outcome bench(const BenchOptions&);

// Of engine "local" the exit code is that of what ran, else 0.
Outcome farm_submit(const detail::FarmOptions&);
Outcome farm_status(const fs::path& folder);
Outcome farm_cancel(const fs::path& folder);
Outcome farm_work(const detail::WorkOptions&);

Outcome new_scene(const detail::NewSceneOptions&);
// Exit code 2, with all that is wrong, where it cannot even be simulated.
Outcome check_scene(const detail::SceneCheckOptions&);
Outcome render_still(const detail::StillOptions&);
Outcome write_storyboard(const detail::StoryboardOptions&);
// Makes it anew whenever the scene, a model, or an image of one is edited, and prints its name; what is wrong
// with an edit is told, and waited for. Ends by Interrupted alone, or when the picture cannot be written.
Outcome watch_still(detail::StillOptions);
Outcome info(const fs::path& path);
Outcome list_scenes();

}  // namespace limber::cli
