#include <fmt/format.h>

#include <list>
#include <set>

#include "fem/observe.h"
#include "limber/detail/film/look.h"
#include "limber/detail/film/node_values.h"
#include "limber/detail/film/shot.h"
#include "render/annotate.h"
#include "render/arrow.h"
#include "render/card.h"
#include "render/caster.h"
#include "render/color_map.h"
#include "render/cut.h"
#include "render/occlusion.h"
#include "render/outline.h"

namespace limber::detail {

namespace {

const Vec3 pane_color(0.62, 0.74, 0.86);
constexpr double pane_opacity = 0.28, rim_opacity = 0.75;
const Vec3 push_color(0.93, 0.52, 0.10), contact_color(0.16, 0.42, 0.62);
const render::LineLook cage_lines{.color_srgb = {0.12, 0.14, 0.18}, .width_px = 1.2, .opacity = 0.55};
const render::LineLook way_lines{.color_srgb = {0.85, 0.35, 0.05}, .width_px = 3, .opacity = 0.9};
const render::LineLook tree_lines{.color_srgb = {0.25, 0.28, 0.36}, .width_px = 1, .opacity = 0.45};
// Above the first, a coarse stand-in of the second casts the shadow of a surface.
constexpr int max_triangles_that_cast = 60'000, triangles_of_caster = 20'000;

constexpr double outline_step = 0.004, outline_width = 1.6 / 1080;  // of the stage's diagonal, of the height
const Vec3 outline_color(0.10, 0.11, 0.14);
constexpr double inset_rim = 3.0 / 1080;  // of the height
constexpr double words_gone = 4;          // a quarter of a card hides them

constexpr int fine_cells = 300;  // of the maps that find crevices, along a body

double size_of(const SurfaceMesh& mesh) { return bounding_box(mesh.positions).diagonal(); }

using Edges = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;

// Each edge of the triangles once, (E × 2).
Edges edges_of(const Triangles& triangles) {
  std::set<std::pair<int, int>> edges;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) edges.insert(std::minmax({triangles(t, i), triangles(t, (i + 1) % 3)}));
  Edges rows(Eigen::Index(edges.size()), 2);
  Eigen::Index row = 0;
  for (const auto& [a, b] : edges) rows.row(row++) << a, b;
  return rows;
}

// (2E × 3)
Points ends_of(const Edges& edges, const Points& positions) {
  Points ends(2 * edges.rows(), 3);
  for (Eigen::Index e = 0; e < edges.rows(); ++e)
    for (int i = 0; i < 2; ++i) ends.row(2 * e + i) = positions.row(edges(e, i));
  return ends;
}

render::Image8 beside(const render::Image8& left, const render::Image8& right) {
  const int width = left.width + right.width;
  render::Image8 both{width, left.height, {}};
  both.rgb.resize(std::size_t(3) * width * left.height);
  for (int y = 0; y < left.height; ++y) {
    std::uint8_t* row = &both.rgb[std::size_t(3) * y * width];
    std::copy_n(&left.rgb[std::size_t(3) * y * left.width], 3 * left.width, row);
    std::copy_n(&right.rgb[std::size_t(3) * y * right.width], 3 * right.width, row + 3 * left.width);
  }
  return both;
}

// Levels of a grey picture; 0 … 1 beyond the ends is cut off.
template <class Level>
Level level_of(double share) {
  return Level(std::lround(std::clamp(share, 0.0, 1.0) * std::numeric_limits<Level>::max()));
}

// The passes as PNG hold them: docs/files.md.
template <class Level>
render::Raster<Level> encoded(const render::Passes& passes, const std::string& name, double low,
                              double high) {
  render::Raster<Level> raster{passes.width,
                               passes.height,
                               name == "normal"   ? 3
                               : name == "scalar" ? 2
                                                  : 1,
                               {}};
  const std::size_t pixels = std::size_t(passes.width) * std::size_t(passes.height);
  raster.levels.reserve(pixels * std::size_t(raster.channels));
  constexpr Level most = std::numeric_limits<Level>::max();
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool there = passes.object[i] >= 0;
    if (name == "depth") {
      raster.levels.push_back(there ? level_of<Level>((double(passes.depth_m[i]) - low) / (high - low))
                                    : most);
    } else if (name == "object") {
      raster.levels.push_back(Level(passes.object[i] + 1));
    } else if (name == "normal") {
      for (std::size_t c = 0; c < 3; ++c)
        raster.levels.push_back(level_of<Level>(0.5 + 0.5 * double(passes.normal[3 * i + c])));
    } else {
      raster.levels.push_back(there ? level_of<Level>((double(passes.scalar[i]) - low) / (high - low))
                                    : Level(0));
      raster.levels.push_back(there ? most : Level(0));
    }
  }
  return raster;
}

}  // namespace

// One picture, or one half of it: the fine surfaces, or the cages.
struct Shot::Painter::View {
  View(const Shot& from, bool of_cages) : shot(from), cages(of_cages), renderer(from.look_) {
    for (std::size_t b = 0; b < shot.bodies_.size(); ++b) add_body(b);
    for (std::size_t s = 0; s < shot.scenery_.size(); ++s)
      if (shot.scenery_[s].triangles.rows() > 0)
        renderer.set_clip_planes(
            renderer.add_mesh(shot.scenery_[s].triangles, shot.scenery_[s].positions,
                              look_of(shot.scene_.scenery[s], size_of(shot.scenery_[s]))),
            shot.cuts_of(int(shot.bodies_.size() + s)));
    for (std::size_t l = 0; l < shot.scene_.ligaments.size(); ++l) {
      const scenes::LigamentSpec& ligament = shot.scene_.ligaments[l];
      ligaments.push_back(renderer.add_mesh(
          render::rod_triangles(), render::rod(ligament.from_m, ligament.to_m, radius_of(l)),
          {.name = ligament.name, .color_srgb = ligament.color_srgb, .roughness = 0.5}));
    }
    for (std::size_t b = 0; b < shot.bodies_.size(); ++b) add_caster(b);
    const scenes::FilmSpec& film = shot.scene_.film;
    if (film.bounds_lines) renderer.add_lines(render::edges_of(shot.scene_.bounds_m), {});
    if (shot.way_m_.rows() > 0) renderer.add_lines(shot.way_m_, way_lines);
    if (shot.tree_m_.rows() > 0) renderer.add_lines(shot.tree_m_, tree_lines);
    for (const PaneOf& pane : shot.panes_) add_pane(pane);
    if (film.forces)
      // The push, contact body by body, forces given, the second carrier's push.
      for (std::size_t i = 0; i <= shot.bodies_.size() + shot.world_.forces.size() + 1; ++i) {
        const bool is_push = i == 0 || i > shot.bodies_.size();
        const Vec3 nowhere = shot.look_.stage.center();
        arrows.push_back(renderer.add_mesh(
            render::arrow_triangles(), render::arrow(nowhere, nowhere + Vec3::UnitX(), shot.arrow_radius_m_),
            {.name = "arrow", .color_srgb = is_push ? push_color : contact_color, .roughness = 0.6}));
      }
  }

  double radius_of(std::size_t ligament) const {
    constexpr double usual = 1 / 15.0;  // of its length
    const scenes::LigamentSpec& spec = shot.scene_.ligaments[ligament];
    return 0.5 * spec.diameter_m.value_or(usual * (spec.to_m - spec.from_m).norm());
  }

  // Behind the body where it is now.
  Pane pane_of(const PaneOf& of) const {
    const double size = size_of(shot.bodies_[std::size_t(of.body)].surface);
    // A little farther than the wall, beyond which surfaces may be by a hair.
    Box bounds = shot.scene_.bounds_m;
    bounds.lower.array() -= 0.004 * size, bounds.upper.array() += 0.004 * size;
    return pane_behind(boxes[std::size_t(of.body)], bounds, of.wall, 0.08 * size, 0.012 * size);
  }

  void add_pane(const PaneOf& of) {
    const auto add = [&](const Triangles& triangles, const Points& positions, double opacity) {
      return renderer.add_mesh(triangles, positions,
                               {.name = "pane",
                                .color_srgb = pane_color,
                                .roughness = 0.3,
                                .opacity = opacity,
                                .casts_shadow = false});
    };
    const Pane pane = pane_of(of);
    panes.push_back(
        {add(pane_triangles(), pane.glass, pane_opacity), add(rim_triangles(), pane.rim, rim_opacity)});
  }

  void show_pane(std::size_t p, double share) {
    renderer.set_opacity(panes[p].glass, pane_opacity * share);
    renderer.set_opacity(panes[p].rim, rim_opacity * share);
    if (share == 0) return;
    const Pane pane = pane_of(shot.panes_[p]);
    renderer.set_positions(panes[p].glass, pane.glass);
    renderer.set_positions(panes[p].rim, pane.rim);
  }

  bool has_caster(std::size_t b) const {
    return !cages && shot.bodies_[b].surface.triangles.rows() > max_triangles_that_cast;
  }

  void add_body(std::size_t b) {
    const PreparedBody& prepared = shot.bodies_[b];
    const Triangles& hull = shot.world_.bodies[b].surface;
    render::MeshLook look = look_of(shot.scene_.bodies[b], size_of(prepared.surface));
    // Light through a body has a colour of its own, which would be read as a number.
    if (shot.scene_.film.color_by != scenes::ColorBy::body) look.translucency = 0;
    look.casts_shadow = !has_caster(b);
    if (cages) look.crease_angle_deg = 0, look.grain = 0;
    const SurfaceMesh& fine = prepared.surface;
    meshes.push_back(cages                      ? renderer.add_mesh(hull, prepared.cage.positions, look)
                     : shot.shows_own_colors(b) ? renderer.add_mesh(fine.triangles, fine.positions, look,
                                                                    prepared.appearance, shot.images_[b])
                                                : renderer.add_mesh(fine.triangles, fine.positions, look));
    renderer.set_clip_planes(meshes.back(), shot.cuts_of(int(b)));
    rest_normals.push_back(vertex_normals(prepared.surface.positions, prepared.surface.triangles));
    hulls.push_back(prepared.cage.positions);
    boxes.push_back(bounding_box(prepared.surface.positions));
    crevices.push_back(open_in_crevices(b));
    if (!cages && !shot.scene_.film.cages) return;
    cage_edges.push_back(edges_of(hull));
    cage_lines_of.push_back(renderer.add_lines(ends_of(cage_edges[b], prepared.cage.positions), cage_lines));
  }

  // After all that is seen, so that the numbers of meshes are those of bodies and scenery.
  void add_caster(std::size_t b) {
    Caster& made = casters.emplace_back();
    if (!has_caster(b)) return;
    const SurfaceMesh& surface_at_rest = shot.bodies_[b].surface;
    render::MeshLook look = look_of(shot.scene_.bodies[b], size_of(surface_at_rest));
    look.seen = false;
    made.stand_in = render::coarse_caster(surface_at_rest, triangles_of_caster);
    made.mesh =
        renderer.add_mesh(made.stand_in.triangles, made.stand_in.positions(surface_at_rest.positions), look);
    renderer.set_clip_planes(made.mesh, shot.cuts_of(int(b)));
  }

  // From the nodes of a body's cage to the rows of its mesh, by the weights of the binding. Where only some
  // nodes have a value, by the weights of those.
  Eigen::VectorXd on_mesh(std::size_t b, const Eigen::VectorXd& of_node,
                          const std::vector<bool>& has_value = {}) const {
    if (cages) return of_node;
    const PreparedBody& prepared = shot.bodies_[b];
    Eigen::VectorXd values(prepared.surface.positions.rows());
    for (Eigen::Index v = 0; v < values.rows(); ++v) {
      double sum = 0, weights = 0;
      for (int i = 0; i < 4; ++i) {
        const int node = prepared.cage.tets(prepared.binding.tet_from_vertex[v], i);
        if (!has_value.empty() && !has_value[std::size_t(node)]) continue;
        const double weight = has_value.empty() ? prepared.binding.weights(v, i)
                                                : std::max(prepared.binding.weights(v, i), 1e-3);
        sum += weight * of_node[node], weights += weight;
      }
      values[v] = weights > 0 ? sum / weights : 0;
    }
    return values;
  }

  Points colors_of(const Eigen::VectorXd& values) const {  // (rows × 3) sRGB
    Points colors(values.rows(), 3);
    for (Eigen::Index v = 0; v < values.rows(); ++v) {
      const double share = (values[v] - shot.low_) / (shot.high_ - shot.low_);
      colors.row(v) = (shot.scene_.film.color_by == scenes::ColorBy::volume ? render::diverging_srgb(share)
                                                                            : render::sequential_srgb(share))
                          .transpose();
    }
    return colors;
  }

  // What the occluders hide of the sky of bodies [first, last), body by body: found at the nodes of their
  // cages, of all bodies at once, since looking along each direction costs more than asking.
  std::vector<Eigen::VectorXd> hidden_by(const std::vector<render::Occluder>& occluders, std::size_t first,
                                         std::size_t last) const {
    Eigen::Index count = 0;
    for (std::size_t b = first; b < last; ++b)
      count += Eigen::Index(shot.world_.bodies[b].surface_nodes.size());
    Points points(count, 3), outward(count, 3);
    count = 0;
    for (std::size_t b = first; b < last; ++b) {
      const fem::Body& body = shot.world_.bodies[b];
      const Points hull_normals = vertex_normals(hulls[b], body.surface);
      for (const int node : body.surface_nodes) {
        points.row(count) = hulls[b].row(node);
        outward.row(count++) = hull_normals.row(node);
      }
    }
    const Eigen::VectorXd hidden = render::sky_occlusion(points, outward, occluders);
    std::vector<Eigen::VectorXd> of_bodies;
    count = 0;
    for (std::size_t b = first; b < last; ++b) {
      Eigen::VectorXd of_node = Eigen::VectorXd::Zero(hulls[b].rows());
      std::vector<bool> on_surface(std::size_t(hulls[b].rows()), false);
      for (const int node : shot.world_.bodies[b].surface_nodes)
        of_node[node] = hidden[count++], on_surface[std::size_t(node)] = true;
      of_bodies.push_back(on_mesh(b, of_node, on_surface));
    }
    return of_bodies;
  }

  // The cage knows no crevices: of the sky that it leaves open at rest, the share that the fine surface does.
  // Of what is cut the rest hides nothing, as far as the body stays where it is at rest.
  Eigen::ArrayXd open_in_crevices(std::size_t b) const {
    const PreparedBody& prepared = shot.bodies_[b];
    if (cages || !shot.output_.occlusion || shot.scene_.bodies[b].opacity < 1) return {};
    const std::vector<render::Plane> cuts = shot.cuts_of(int(b));
    const SurfaceMesh& fine = prepared.surface;
    SurfaceMesh cage_left{prepared.cage.positions, shot.world_.bodies[b].surface}, fine_left;
    if (!cuts.empty())
      cage_left = render::cut_coarsely(cage_left, cuts), fine_left = render::cut_coarsely(fine, cuts);
    const SurfaceMesh& hides = cuts.empty() ? fine : fine_left;
    const Eigen::VectorXd coarse = hidden_by({{cage_left.positions, cage_left.triangles}}, b, b + 1)[0],
                          hidden =
                              render::sky_occlusion(fine.positions, rest_normals[b],
                                                    {{{hides.positions, hides.triangles}}}, {}, fine_cells);
    return ((1 - hidden.array()) / (1 - coarse.array()).max(0.05)).min(1.0);
  }

  // What bodies hide of one another's sky, found between the cages, and what of their own in crevices.
  void occlude() {
    if (!shot.output_.occlusion) return;
    std::vector<render::Occluder> occluders;
    std::list<SurfaceMesh> left;  // of what is cut
    for (std::size_t b = 0; b < hulls.size(); ++b) {
      if (shot.scene_.bodies[b].opacity < 1) continue;
      const std::vector<render::Plane> cuts = shot.cuts_of(int(b));
      if (cuts.empty()) {
        occluders.push_back({hulls[b], shot.world_.bodies[b].surface});
        continue;
      }
      left.push_back(render::cut_coarsely({hulls[b], shot.world_.bodies[b].surface}, cuts));
      occluders.push_back({left.back().positions, left.back().triangles});
    }
    std::vector<Eigen::VectorXd> of_bodies = hidden_by(occluders, 0, hulls.size());
    for (std::size_t b = 0; b < hulls.size(); ++b) {
      Eigen::VectorXd& hidden = of_bodies[b];
      if (crevices[b].size() > 0) hidden = 1 - (1 - hidden.array()) * crevices[b];
      renderer.set_occlusion(meshes[b], hidden);
    }
  }

  void move_body(std::size_t b) {
    const PreparedBody& prepared = shot.bodies_[b];
    const Points& hull = hulls[b];
    if (!cage_lines_of.empty()) renderer.set_lines(cage_lines_of[b], ends_of(cage_edges[b], hull));
    if (cages) {
      boxes[b] = bounding_box(hull);
      renderer.set_positions(meshes[b], hull);
      return;
    }
    surface.resize(prepared.surface.positions.rows(), 3);
    normals.resize(surface.rows(), 3);
    deform(prepared, hull, surface);
    boxes[b] = bounding_box(surface);
    ffd::deform_normals(prepared.binding, prepared.cage, hull, rest_normals[b], normals);
    renderer.set_positions(meshes[b], surface, normals);
    if (casters[b].mesh >= 0) renderer.set_positions(casters[b].mesh, casters[b].stand_in.positions(surface));
  }

  void show(int frame) {
    const scenes::ColorBy by = shot.scene_.film.color_by;
    const State state = shot.state_at(frame);
    std::vector<double> values;
    if (by != scenes::ColorBy::body) values = node_values(shot.world_, state, by);
    for (std::size_t b = 0; b < meshes.size(); ++b) {
      const fem::Body& body = shot.world_.bodies[b];
      if (!values.empty() && body.kind == fem::BodyKind::deformable) {
        const Eigen::VectorXd of_vertex = on_mesh(
            b, Eigen::Map<const Eigen::VectorXd>(&values[std::size_t(body.first_node)], body.node_count()));
        renderer.set_colors(meshes[b], colors_of(of_vertex));
        renderer.set_scalars(meshes[b], of_vertex);
      }
      if (!body.moving) continue;
      hulls[b] = fem::body_positions(shot.world_, state, int(b));
      move_body(b);
    }
    const std::vector<fem::LigamentPull> pulls = fem::ligament_pulls(shot.world_, state);
    for (std::size_t l = 0; l < pulls.size(); ++l)
      renderer.set_positions(ligaments[l], render::rod(pulls[l].from_m, pulls[l].to_m, radius_of(l)));
    occlude();
    for (std::size_t p = 0; p < panes.size(); ++p) show_pane(p, shot.shown(shot.panes_[p].shown, frame));
    if (arrows.empty()) return;
    const Points ends = shot.arrows_at(frame);
    for (std::size_t i = 0; i < arrows.size(); ++i) {
      const Eigen::Index row = 2 * Eigen::Index(i);
      renderer.set_positions(arrows[i],
                             render::arrow(ends.row(row), ends.row(row + 1), shot.arrow_radius_m_));
    }
  }

  struct Caster {
    int mesh = -1;  // none
    render::Caster stand_in;
  };
  const Shot& shot;
  bool cages;
  render::Renderer renderer;
  std::vector<int> meshes, ligaments, cage_lines_of, arrows;
  struct PaneMeshes {
    int glass, rim;
  };
  std::vector<PaneMeshes> panes;
  std::vector<Box> boxes;                   // a body, as it is now
  std::vector<Caster> casters;              // a body
  std::vector<Points> hulls, rest_normals;  // a body; the cage's nodes as they are now
  std::vector<Eigen::ArrayXd> crevices;     // a body; empty: none
  std::vector<Edges> cage_edges;
  Points surface, normals;
};

Shot::Painter::Painter(const Shot& shot) : shot_(shot) {
  views_.push_back(std::make_unique<View>(shot, false));
  if (shot.scene_.film.side_by_side) views_.push_back(std::make_unique<View>(shot, true));
  if (shot.inset_) inset_ = std::make_unique<Painter>(*shot.inset_);
}
Shot::Painter::~Painter() = default;

// In 8 bit and with a background, so words and bars can be drawn on it.
render::Image8 Shot::Painter::annotated(render::Image8 image, int frame) const {
  const scenes::FilmSpec& film = shot_.scene_.film;
  if (film.color_by != scenes::ColorBy::body)
    render::draw_color_bar(image,
                           {.label = caption_of(film.color_by),
                            .low = shot_.low_,
                            .high = shot_.high_,
                            .color_srgb = film.color_by == scenes::ColorBy::volume ? render::diverging_srgb
                                                                                   : render::sequential_srgb,
                            .on_dark = shot_.words_.on_dark});
  for (const Name& name : shot_.names_at(frame))
    render::draw_label(image, name.words, name.place, name.end, shot_.letter_px_, shot_.words_.on_dark,
                       name.share);
  const std::string clock = shot_.clock_at(frame);
  if (!film.caption.empty() || !clock.empty()) render::draw_caption(image, film.caption, clock, shot_.words_);
  if (film.scale_bar) {
    const double pixels = shot_.scale_m_ * shot_.pixels_a_metre(shot_.camera_of(frame));
    const bool taken = shot_.words_.corner == render::Corner::bottom_right;
    render::draw_scale_bar(image, length_words(shot_.scale_m_), pixels,
                           {.corner = taken ? render::Corner::bottom_left : render::Corner::bottom_right,
                            .on_dark = shot_.words_.on_dark});
  }
  return image;
}

render::Image8 Shot::Painter::without_words(int frame, render::Passes* wanted) {
  const render::Camera camera = shot_.camera_of(frame);
  const bool outlines = shot_.scene_.film.outlines;
  const auto drawn = [&](View& view) {
    render::Passes own;
    view.show(frame);
    render::Passes* passes = wanted && &view == views_[0].get() ? wanted : outlines ? &own : nullptr;
    render::Image8 image = view.renderer.draw_shown(camera, passes);
    if (outlines)
      render::draw_outlines(image, *passes, outline_step * shot_.look_.stage.diagonal(),
                            outline_width * image.height, outline_color);
    return image;
  };
  render::Image8 image = drawn(*views_[0]);
  if (views_.size() > 1) image = beside(image, drawn(*views_[1]));
  if (inset_) {
    const Eigen::Vector4d place = shot_.place_of_inset(shot_.inset_corner_);
    render::paste(image, inset_->without_words(frame, nullptr), int(place[0]), int(place[1]),
                  std::max(1, int(std::lround(inset_rim * image.height))),
                  shot_.words_.on_dark ? Vec3(0.85, 0.85, 0.85) : Vec3(1, 1, 1));
  }
  return image;
}

// Of two kinds of words at once one reads neither: caption, clock and names come when the card has nearly
// gone.
render::Image8 Shot::Painter::with_card(int frame, render::Passes* wanted) {
  const scenes::CardSpec* spec = shot_.card_of(frame);
  if (spec != card_of_ || wanted) {
    bare_ = without_words(frame, wanted);
    still_ = annotated(bare_, frame);
    card_ = spec->plain ? render::plain_card(bare_.width, bare_.height, spec->lines,
                                             shot_.look_.background_bottom_srgb)
                        : render::card(bare_, spec->lines);
    card_of_ = spec;
  }
  const double share = shot_.card_share(frame);
  return render::mixed(render::mixed(still_, bare_, std::min(1.0, words_gone * share)), card_, share);
}

Picture Shot::Painter::paint(int frame) {
  const render::Camera camera = shot_.camera_of(frame);
  const Output& output = shot_.output_;
  const bool transparent = shot_.scene_.film.transparent;
  render::Passes passes;
  render::Passes* const wanted = output.passes.empty() ? nullptr : &passes;
  const auto linear = [&] {
    views_[0]->show(frame);
    return views_[0]->renderer.draw(camera, wanted);
  };
  Picture picture;
  if (output.bits == 16)
    picture.frame = transparent ? render::tone_mapped_alpha_16(linear()) : render::tone_mapped_16(linear());
  else if (transparent)
    picture.frame = render::tone_mapped_alpha(linear());
  else if (shot_.card_of(frame))
    picture.frame = with_card(frame, wanted);
  else
    picture.frame = annotated(without_words(frame, wanted), frame);
  for (const std::string& name : output.passes) {
    const bool depth = name == "depth";
    const double low = depth ? shot_.near_m_ : shot_.low_, high = depth ? shot_.far_m_ : shot_.high_;
    if (name == "object" || output.bits == 8)
      picture.passes[name] = encoded<std::uint8_t>(passes, name, low, high);
    else
      picture.passes[name] = encoded<std::uint16_t>(passes, name, low, high);
  }
  return picture;
}

}  // namespace limber::detail
