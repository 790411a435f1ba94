// What is promised of every frame of any motion, planned or simulated: that no body is squeezed, turned
// inside out, stretched or seen to pass through another by more than limber allows. Figures are
// measure_motion's (limber/detail/world/analysis.h), over the frames of the replay.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "limber/detail/verify/verify_plan.h"
#include "limber/detail/world/seen.h"

namespace limber::detail {

namespace {

// Promises where contact is on the surfaces that are seen, findings where it is between cages: there surfaces
// follow the cages that touch, and may overlap or stand apart. Limits are shares of the longest edge of the
// box of the robot's surface at rest (docs/seen.md).
void check_seen(const MotionFigures& figures, bool promised, Promises& table) {
  const SeenLimits limits;
  const auto row = [&](const std::string& what, const std::string& limit, bool kept,
                       const std::string& value) {
    promised ? table.row(what + ": " + limit, kept, value) : table.measured(what, value);
  };
  const double size = figures.robot_surface_size_m;
  const auto percent = [](double share) { return fmt::format("{:g} %", 100 * share); };
  const auto of_size = [&](double metres) { return fmt::format("{:.2f} %", 100 * metres / size); };
  row("what is seen: deepest overlap of two surfaces", "at most " + percent(limits.overlap),
      figures.deepest_overlap_m <= limits.overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_overlap_m, of_size(figures.deepest_overlap_m),
                  figures.overlap_between));
  const auto gap_row = [&](const std::string& what, const GapFigures& gap) {
    row("what is seen: " + what,
        fmt::format("in the median below {}, below {}", percent(limits.median_gap),
                    percent(limits.worst_gap)),
        gap.count == 0 || (gap.median_m < limits.median_gap * size && gap.worst_m < limits.worst_gap * size),
        gap.count == 0
            ? gap.worst_between
            : fmt::format("median {}, worst {} ({}), of {} pairs and frames", of_size(gap.median_m),
                          of_size(gap.worst_m), gap.worst_between, gap.count));
  };
  gap_row("gap between surfaces that press each other", figures.gap);
  gap_row("the same gap where the strongest force acts", figures.gap_at_contact);
  gap_row("gap between a surface and a wall that it presses", figures.gap_to_wall);
  row("what is seen: a body's overlap with itself", "at most " + percent(limits.self_overlap),
      figures.deepest_self_overlap_m <= limits.self_overlap * size,
      fmt::format("{:.4f} m, {} ({})", figures.deepest_self_overlap_m,
                  of_size(figures.deepest_self_overlap_m), figures.self_overlap_of));
  table.measured("what is seen: deepest overlap of a surface and a wall, beyond that at the start",
                 fmt::format("{:.4f} m, {} ({})", figures.deepest_wall_overlap_m,
                             of_size(figures.deepest_wall_overlap_m), figures.wall_overlap_of));
  table.measured("least and largest stretch of a tet",
                 fmt::format("{:.3f} ({}), {:.3f} ({})", figures.min_stretch, figures.min_stretch_of,
                             figures.largest_stretch, figures.largest_stretch_of));
}

// Of each body that promises it, at every frame: the singular values of F = E E₀⁻¹ of each tet (edges now,
// edges at rest) lie within 1/s and s, but for rounding.
void check_stretch(const MotionFigures& figures, const fem::World& world, Promises& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const double most = world.bodies[b].max_stretch;
    if (!world.bodies[b].moving || !std::isfinite(most)) continue;
    double least = 1, largest = 1;
    for (const FrameFigures& frame : figures.frames)
      least = std::min(least, frame.bodies[b].min_stretch),
      largest = std::max(largest, frame.bodies[b].largest_stretch);
    table.row(
        fmt::format("{}: tets are stretched within {:.3g} and {:.3g}", world.bodies[b].name, 1 / most, most),
        least >= 1 / most * (1 - 1e-6) && largest <= most * (1 + 1e-6),
        fmt::format("{:.3f}, {:.3f}", least, largest));
  }
}

// Of each body that promises it, at every frame: what presses it, as a search measures it.
void check_contact_loads(const MotionFigures& figures, const fem::World& world, Promises& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const double most = world.bodies[b].max_contact_load_n;
    if (!std::isfinite(most)) continue;
    double largest = 0;
    for (const FrameFigures& frame : figures.frames)
      largest = std::max(largest, frame.bodies[b].contact_load_n);
    table.row(fmt::format("{}: is pressed by at most {:g} N", world.bodies[b].name, most), largest <= most,
              fmt::format("{:.3g} N", largest));
  }
}

}  // namespace

// Volumes are |V − V₀|/V₀ of whole bodies. Where contact is on surfaces, how deep cages are in one another
// says nothing, and is not promised.
void check_shapes(const MotionFigures& figures, const fem::World& world, Promises& table) {
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (world.bodies[b].moving)
      table.row(fmt::format("{}: volume changes by at most {:g} %", world.bodies[b].name,
                            100 * world.bodies[b].max_volume_change),
                figures.largest_volume_change[b] <= world.bodies[b].max_volume_change,
                fmt::format("{:.2f} %", 100 * figures.largest_volume_change[b]));
  table.row("no tet is inverted at a frame", figures.inverted_tets == 0,
            fmt::format("{}", figures.inverted_tets));
  if (!world.touches_on_surfaces())
    table.row(
        "penetration of cages is at most 4 % of the robot's size",
        figures.deepest_penetration_m <= largest_cage_penetration_m(world),
        fmt::format("{:.4f} m, {:.2f} % ({})", figures.deepest_penetration_m,
                    100 * figures.deepest_penetration_m / figures.robot_size_m, figures.penetration_between));
  check_stretch(figures, world, table);
  check_contact_loads(figures, world, table);
  check_seen(figures, world.touches_on_surfaces(), table);
}

}  // namespace limber::detail
