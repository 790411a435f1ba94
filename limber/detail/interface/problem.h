// What Scene, Problem and Plan of the interface hold.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "limber/detail/body/work_folder.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/scene_world.h"
#include "limber/scene.h"

namespace limber {

struct [[gnu::visibility("hidden")]] Scene::Impl {
  scenes::Scene scene;
  std::vector<std::filesystem::path> data;
};

struct [[gnu::visibility("hidden")]] Problem::Impl {
  Scene scene;
  detail::WorkFolder folder;
  detail::BodiesAndWorld made;
  const std::vector<detail::PreparedBody>& prepared = made.bodies;
  const fem::World& world = made.world;
  std::vector<Body> bodies = {};
  detail::FemSystem system;   // without a goal: what rollouts need
  std::size_t state_numbers;  // of positions, and of velocities

  // Scratch memory of threads that step, kept between calls.
  mutable std::mutex mutex = {};
  mutable std::vector<std::unique_ptr<plan::Propagator>> idle = {};

  // Prepares what is not up to date.
  Impl(const Scene&, const std::filesystem::path& work_folder);
  // Of a plan in its folder.
  Impl(const detail::PlanFolder&, const std::filesystem::path& folder);

 private:
  Impl(const Scene&, const std::filesystem::path& work_folder,
       const std::function<detail::BodiesAndWorld(const std::filesystem::path&)>& make);
};

struct [[gnu::visibility("hidden")]] Plan::Impl {
  Problem problem;
  plan::Plan plan;
  Json extra = {};
  Json summary = {};  // of a plan that was read; else null

  explicit Impl(Problem of, plan::Plan found, Json more = {})
      : problem(std::move(of)), plan(std::move(found)), extra(std::move(more)) {}

  mutable std::once_flag measured = {};
  mutable detail::MotionFigures figures = {};
  const detail::MotionFigures& motion_figures() const;
};

}  // namespace limber
