#include "limber/detail/plan/tree_plot.h"

#include <fmt/format.h>

#include <algorithm>

#include "fem/observe.h"
#include "limber/detail/world/goal_terms.h"

namespace limber::detail {

namespace {

constexpr int max_edges = 4000;
constexpr double longer_side_px = 900, margin_px = 30;

// One projection: two axes of the world, and where they go on the page.
struct View {
  int across, up;
  Box bounds;
  double scale, left, top;

  double x(const Vec3& p) const { return left + scale * (p[across] - bounds.lower[across]); }
  double y(const Vec3& p) const { return top + scale * (bounds.upper[up] - p[up]); }
  double width() const { return scale * bounds.size()[across]; }
  double height() const { return scale * bounds.size()[up]; }
  std::string at(const Vec3& p) const { return fmt::format("{:.1f} {:.1f}", x(p), y(p)); }
};

// Filled, all triangles turned the same way, so that they add up to the silhouette.
std::string silhouette(const View& view, const fem::Body& body, const Points& places) {
  std::string path;
  for (int t = 0; t < body.surface.rows(); ++t) {
    Vec3 p[3];
    for (int i = 0; i < 3; ++i) p[i] = places.row(body.surface(t, i)).transpose();
    const double area = (view.x(p[1]) - view.x(p[0])) * (view.y(p[2]) - view.y(p[0])) -
                        (view.x(p[2]) - view.x(p[0])) * (view.y(p[1]) - view.y(p[0]));
    if (area == 0) continue;
    if (area < 0) std::swap(p[1], p[2]);
    path += fmt::format("M{}L{}L{}Z", view.at(p[0]), view.at(p[1]), view.at(p[2]));
  }
  return path;
}

std::string color_of(const Vec3& srgb) {
  return fmt::format("rgb({:.0f},{:.0f},{:.0f})", 255 * srgb.x(), 255 * srgb.y(), 255 * srgb.z());
}

void draw(const View& view, const scenes::Scene& scene, const fem::World& world, const plan::Plan& plan,
          std::string& svg) {
  const plan::Tree& tree = plan.tree;
  const State start = fem::start_state(world);
  const auto center = [&](int node) { return Vec3(tree.centers[node].cast<double>()); };
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#fff\" stroke=\"#888\"/>\n",
      view.left, view.top, view.width(), view.height());
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const bool robot = int(b) == world.robot;
    svg += fmt::format("<path class=\"body\" d=\"{}\" fill=\"{}\" fill-opacity=\"{}\"/>\n",
                       silhouette(view, world.bodies[b], fem::body_positions(world, start, int(b))),
                       color_of(scene.bodies[b].color_srgb), robot ? 0.25 : 0.45);
  }
  for (const plan::Via& via : plan.settings.via)
    svg += fmt::format(
        "<circle class=\"via\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"#2a2\" fill-opacity=\"0.15\" "
        "stroke=\"#2a2\" stroke-dasharray=\"3 3\"/>\n",
        view.x(via.goal.center_of_mass_m), view.y(via.goal.center_of_mass_m), view.scale * via.goal.radius_m);
  const Vec3& goal = plan.settings.goal.center_of_mass_m;
  svg += fmt::format(
      "<circle class=\"goal\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"#2a2\" fill-opacity=\"0.3\" "
      "stroke=\"#2a2\"/>\n",
      view.x(goal), view.y(goal), view.scale * plan.settings.goal.radius_m);
  const int every = (tree.size() + max_edges - 1) / max_edges;
  std::string edges, nodes;
  for (int n = 1; n < tree.size(); n += every) {
    edges += fmt::format("M{}L{}", view.at(center(tree.parents[std::size_t(n)])), view.at(center(n)));
    nodes += fmt::format("M{}h0", view.at(center(n)));
  }
  svg += fmt::format(
      "<path class=\"edges\" d=\"{}\" fill=\"none\" stroke=\"#557\" stroke-opacity=\"0.45\" "
      "stroke-width=\"0.8\"/>\n",
      edges);
  svg += fmt::format(
      "<path class=\"nodes\" d=\"{}\" fill=\"none\" stroke=\"#223\" stroke-width=\"3\" "
      "stroke-linecap=\"round\"/>\n",
      nodes);
  std::string path;
  for (const State& frame : plan.trajectory.frames)
    path += fmt::format("{}{}", path.empty() ? "M" : "L", view.at(robot_place_m(scene, world, frame)));
  svg += fmt::format(
      "<path class=\"path\" d=\"{}\" fill=\"none\" stroke=\"#d22\" stroke-width=\"2.5\" "
      "stroke-linejoin=\"round\"/>\n",
      path);
  svg += fmt::format("<circle class=\"start\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"#d22\"/>\n",
                     view.x(center(0)), view.y(center(0)));
}

}  // namespace

std::string tree_svg(const scenes::Scene& scene, const fem::World& world, const plan::Plan& plan) {
  const Vec3 size = world.bounds_m.size();
  const double scale = longer_side_px / size.maxCoeff();
  const View above{0, 1, world.bounds_m, scale, margin_px, 2 * margin_px};
  const View side{0, 2, world.bounds_m, scale, margin_px, above.top + above.height() + 2 * margin_px};
  const double width = std::max(above.width() + 2 * margin_px, 400.0),
               height = side.top + side.height() + margin_px;
  std::string svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"13\" "
      "fill=\"#333\">\n"
      "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"#fff\"/>\n",
      width, height);
  svg += fmt::format(
      "<text x=\"{}\" y=\"24\" font-size=\"16\" font-weight=\"bold\">{}: {} nodes, {}</text>\n", margin_px,
      scene.name, plan::nodes_of(plan), plan.solved() ? "path to the goal" : "path to the nearest");
  for (const auto& [view, name] : {std::pair(&above, "from above"), std::pair(&side, "from the side (−y)")}) {
    svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}</text>\n", margin_px, view->top - 8, name);
    draw(*view, scene, world, plan, svg);
  }
  return svg + "</svg>\n";
}

}  // namespace limber::detail
