#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <limits>

#include "core/error.h"
#include "core/json.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/split_at_seams.h"
#include "core/version.h"
#include "fem/observe.h"
#include "limber/detail/exports/motion_files.h"
#include "render/image.h"
#include "render/renderer.h"

namespace limber::detail {

namespace {

// Ours, z up, to glTF's, y up.
Points y_up(const Points& p) {
  Points turned(p.rows(), 3);
  turned << p.col(0), p.col(2), -p.col(1);
  return turned;
}

struct Pose {  // x ↦ turn · x + shift
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Vec3 shift = Vec3::Zero();
};

// Brings `from` as near to `to` as it can (Kabsch, Acta Crystallographica A32, 1976). The turn is rounded to
// the float32 that will be stored.
Pose best_fit(const Points& from, const Points& to) {
  const Vec3 from_middle = from.colwise().mean(), to_middle = to.colwise().mean();
  const Eigen::Matrix3d covariance =
      (from.rowwise() - from_middle.transpose()).transpose() * (to.rowwise() - to_middle.transpose());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const bool mirrors = (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0;
  const Eigen::Matrix3d turn =
      svd.matrixV() * Vec3(1, 1, mirrors ? -1 : 1).asDiagonal() * svd.matrixU().transpose();
  Pose pose;
  pose.turn = Eigen::Quaterniond(Eigen::Quaterniond(turn).cast<float>()).normalized();
  pose.shift = to_middle - pose.turn * from_middle;
  return pose;
}

// A linear map as turn · scale · turn; one number of the scale is negative where the map mirrors.
struct Stretch {
  Eigen::Matrix3d outer = Eigen::Matrix3d::Identity(), inner = Eigen::Matrix3d::Identity();  // U, V: U S Vᵀ
  Vec3 scale = Vec3::Ones();
};

// The axes of a stretch have 24 orders and signs. That whose V is nearest to the one before is taken: then U
// and V turn alike from frame to frame, and what viewers show between two frames is near to both.
Stretch stretch_of(const Eigen::Matrix3d& map, const Stretch& before) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(map, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  Vec3 scale = svd.singularValues();
  if (v.determinant() < 0) v.col(2) *= -1, u.col(2) *= -1;
  if (u.determinant() < 0) u.col(2) *= -1, scale[2] *= -1;
  Stretch nearest;
  double most = -std::numeric_limits<double>::infinity();
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes;
      for (int k = 0; k < 3; ++k) axes.col(k) = (signs >> k & 1 ? -1 : 1) * v.col(order[std::size_t(k)]);
      const double likeness = (before.inner.transpose() * axes).trace();
      if (axes.determinant() < 0 || likeness <= most) continue;
      most = likeness;
      nearest.inner = axes;
      for (int k = 0; k < 3; ++k) {
        nearest.outer.col(k) = (signs >> k & 1 ? -1 : 1) * u.col(order[std::size_t(k)]);
        nearest.scale[k] = scale[order[std::size_t(k)]];
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return nearest;
}

// As x y z w, in that of its two signs which is nearer to the one before.
void append(std::vector<float>& turns, const Eigen::Quaterniond& turn) {
  double likeness = 0;
  for (std::size_t k = 0; k < 4 && !turns.empty(); ++k)
    likeness += double(turns[turns.size() - 4 + k]) * turn.coeffs()[Eigen::Index(k)];
  for (int k = 0; k < 4; ++k) turns.push_back(float(likeness < 0 ? -turn.coeffs()[k] : turn.coeffs()[k]));
}

std::vector<float> floats_of(const auto& rows) { return {rows.data(), rows.data() + rows.size()}; }

// The document, and the bytes that it speaks of.
class Gltf {
 public:
  enum Target { none = 0, vertex_attributes = 34962, vertex_indices = 34963 };

  Json document{{"asset", {{"version", "2.0"}, {"generator", fmt::format("limber {}", version)}}}};

  // Appends to a list of the document; returns the place.
  int add(const std::string& list, Json entry) {
    document[list].push_back(std::move(entry));
    return int(document[list].size()) - 1;
  }

  // Accessors that follow share this view.
  void begin_view(Target target) {
    view_begin_ = bytes_.size();
    Json view{{"buffer", 0}, {"byteOffset", view_begin_}, {"byteLength", 0}};
    if (target != none) view["target"] = int(target);
    view_ = add("bufferViews", view);
  }
  // `components` numbers an element: 1, 2, 3, 4 or 16.
  template <class T>
  int accessor(const std::vector<T>& values, int components, bool with_bounds = false) {
    constexpr int type_of_number = std::is_same_v<T, float>           ? 5126
                                   : std::is_same_v<T, std::uint32_t> ? 5125
                                                                      : 5123;  // of unsigned 16 bit
    Json entry{{"bufferView", view_},
               {"byteOffset", bytes_.size() - view_begin_},
               {"componentType", type_of_number},
               {"count", values.size() / std::size_t(components)},
               {"type", components == 1   ? "SCALAR"
                        : components == 2 ? "VEC2"
                        : components == 3 ? "VEC3"
                        : components == 4 ? "VEC4"
                                          : "MAT4"}};
    if (with_bounds)
      for (int c = 0; c < components; ++c) {
        double low = values[std::size_t(c)], high = low;
        for (std::size_t i = std::size_t(c); i < values.size(); i += std::size_t(components))
          low = std::min(low, double(values[i])), high = std::max(high, double(values[i]));
        entry["min"].push_back(low), entry["max"].push_back(high);
      }
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    document["bufferViews"].back()["byteLength"] = bytes_.size() - view_begin_;
    return add("accessors", std::move(entry));
  }
  template <class T>
  int accessor_alone(const std::vector<T>& values, int components, Target target, bool with_bounds = false) {
    begin_view(target);
    return accessor(values, components, with_bounds);
  }

  // A file as it is; returns the number of a texture that shows it.
  int texture(const ImageFile& image) {
    begin_view(none);
    bytes_ += image.bytes;
    document["bufferViews"].back()["byteLength"] = image.bytes.size();
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    const char* type = extension_of_image(image.bytes) == ".png" ? "image/png" : "image/jpeg";
    const int source = add("images", {{"name", image.name}, {"bufferView", view_}, {"mimeType", type}});
    constexpr int linear = 9729, linear_mipmap_linear = 9987;
    if (!document.contains("samplers"))
      add("samplers", {{"magFilter", linear}, {"minFilter", linear_mipmap_linear}});
    return add("textures", {{"sampler", 0}, {"source", source}});
  }

  std::string binary() {
    document["buffers"] = {{{"byteLength", bytes_.size()}}};
    std::string json = document.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::uint64_t size = 12 + 8 + json.size() + 8 + bytes_.size();
    if (size > std::numeric_limits<std::uint32_t>::max())
      throw InputError(
          fmt::format("the motion makes {:.1f} GB of glTF, but a .glb file holds 4; choose fewer --frames",
                      1e-9 * double(size)));
    std::string file = "glTF";
    const auto number = [&](std::uint64_t n) {
      const auto narrow = std::uint32_t(n);
      file.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
    };
    number(2), number(size);
    number(json.size()), file += "JSON" + json;
    number(bytes_.size()), file += std::string("BIN\0", 4) + bytes_;
    return file;
  }

 private:
  std::string
      bytes_;  // of whole float32 and of 16 bit in fours, so that every view begins at a multiple of 4
  std::size_t view_begin_ = 0;
  int view_ = 0;
};

class GltfWriter {
 public:
  explicit GltfWriter(const PlannedMotion& motion) : motion_(motion) {
    std::vector<float> times;
    for (const int f : motion.wanted)
      times.push_back(float(motion.time_s(f) - motion.time_s(motion.wanted.front())));
    times_ = gltf_.accessor_alone(times, 1, Gltf::none, true);
    animation_ = {{"name", motion.scene.name}, {"channels", Json::array()}, {"samplers", Json::array()}};
  }

  void add(int b) {
    const fem::Body& body = motion_.world.bodies[std::size_t(b)];
    const Json node{{"name", body.name}, {"mesh", mesh(b)}};
    if (!body.moving) {
      add_root(node);
      return;
    }
    const Points rest = y_up(body.cage.positions);
    std::vector<Points> cages;
    for (const int f : motion_.wanted) {
      throw_if_stopped();
      cages.push_back(y_up(fem::body_positions(motion_.world, motion_.frames[std::size_t(f)], b)));
    }
    std::vector<Pose> poses;
    for (const Points& cage : cages) poses.push_back(best_fit(rest, cage));
    if (body.kind != fem::BodyKind::deformable)
      animate(add_root(node), poses);
    else
      add_skin(add_root(node), b, rest, cages, poses);
  }

  std::string binary() {
    gltf_.document["scene"] = 0;
    gltf_.document["scenes"] = {{{"name", motion_.scene.name}, {"nodes", roots_}}};
    if (!animation_["channels"].empty()) gltf_.add("animations", animation_);
    return gltf_.binary();
  }

 private:
  int add_root(const Json& node) {
    roots_.push_back(gltf_.add("nodes", node));
    return roots_.back();
  }

  int material(const std::string& name, const Vec3& color, int texture, int normal_texture) {
    const render::MeshLook look;
    Json surface{{"baseColorFactor", {color.x(), color.y(), color.z(), 1}},
                 {"metallicFactor", look.metallic},
                 {"roughnessFactor", look.roughness}};
    if (texture >= 0) surface["baseColorTexture"] = {{"index", texture}};
    Json made{{"name", name}, {"doubleSided", true}, {"pbrMetallicRoughness", surface}};
    if (normal_texture >= 0) made["normalTexture"] = {{"index", normal_texture}};
    return gltf_.add("materials", made);
  }

  // The plain one first, −1 where nothing is plain; then those of the appearance.
  std::vector<int> materials(const scenes::BodySpec& spec, const Appearance& appearance) {
    const auto& of_triangle = appearance.material_from_triangle;
    const bool some_plain =
        appearance.empty() || std::find(of_triangle.begin(), of_triangle.end(), -1) != of_triangle.end();
    std::vector<int> made{some_plain ? material(spec.name, render::linear_from_srgb(spec.color_srgb), -1, -1)
                                     : -1};
    std::vector<int> textures;
    for (const ImageFile& image : appearance.images) textures.push_back(gltf_.texture(image));
    const auto texture_of = [&](int image) { return image < 0 ? -1 : textures[std::size_t(image)]; };
    for (const SurfaceMaterial& m : appearance.materials)
      made.push_back(material(m.name, m.color, texture_of(m.image), texture_of(m.normal_image)));
    return made;
  }

  int mesh(int b) {
    const PreparedBody& prepared = motion_.bodies[std::size_t(b)];
    const scenes::BodySpec& spec = motion_.scene.bodies[std::size_t(b)];
    const Appearance& appearance = appearance_shown(motion_, b);
    const SurfaceMesh surface{surface_at_rest(motion_.world.bodies[std::size_t(b)], prepared),
                              prepared.surface.triangles};
    Points normals = vertex_normals(surface.positions, surface.triangles);
    for (Eigen::Index v = 0; v < normals.rows(); ++v)
      if (normals.row(v).isZero()) normals.row(v) << 0, 0, 1;  // glTF wants unit vectors
    SplitAtSeams split;
    if (appearance.empty()) {
      split.triangles = surface.triangles;
      for (int v = 0; v < surface.positions.rows(); ++v) split.vertex_from_row.push_back(v);
    } else {
      split = split_at_seams(surface, appearance);
    }
    const std::vector<int>& rows = split.vertex_from_row;
    Json attributes{
        {"POSITION", gltf_.accessor_alone(floats_of(Points(y_up(surface.positions)(rows, Eigen::all))), 3,
                                          Gltf::vertex_attributes, true)},
        {"NORMAL", gltf_.accessor_alone(floats_of(Points(y_up(normals)(rows, Eigen::all))), 3,
                                        Gltf::vertex_attributes)}};
    if (split.uv.rows() > 0) {
      split.uv.col(1) = 1 - split.uv.col(1).array();  // glTF's begins at the top
      attributes["TEXCOORD_0"] = gltf_.accessor_alone(floats_of(split.uv), 2, Gltf::vertex_attributes);
    }
    if (split.colors.rows() > 0)
      attributes["COLOR_0"] = gltf_.accessor_alone(floats_of(split.colors), 3, Gltf::vertex_attributes);
    if (motion_.world.bodies[std::size_t(b)].moving &&
        motion_.world.bodies[std::size_t(b)].kind == fem::BodyKind::deformable)
      add_weights(b, rows, attributes);

    const std::vector<int> made = materials(spec, appearance);
    Json primitives = Json::array();
    for (int m = -1; m < int(appearance.materials.size()); ++m) {
      std::vector<std::uint32_t> corners;
      for (Eigen::Index t = 0; t < split.triangles.rows(); ++t)
        if (appearance.empty() || appearance.material_from_triangle[std::size_t(t)] == m)
          for (int c = 0; c < 3; ++c) corners.push_back(std::uint32_t(split.triangles(t, c)));
      if (corners.empty()) continue;
      primitives.push_back({{"attributes", attributes},
                            {"indices", gltf_.accessor_alone(corners, 1, Gltf::vertex_indices)},
                            {"material", made[std::size_t(m + 1)]}});
    }
    return gltf_.add("meshes", {{"name", spec.name}, {"primitives", primitives}});
  }

  void add_weights(int b, const std::vector<int>& rows, Json& attributes) {
    const PreparedBody& prepared = motion_.bodies[std::size_t(b)];
    const ffd::Binding& binding = prepared.binding;
    const std::string& name = motion_.scene.bodies[std::size_t(b)].name;
    const Eigen::Index nodes = prepared.cage.positions.rows(),
                       most = std::numeric_limits<std::uint16_t>::max();
    if (nodes > most)
      throw InputError(
          fmt::format("bodies.{}: its cage has {} nodes, but a skin of glTF has at most {} joints; prepare a "
                      "coarser cage",
                      name, nodes, most));
    std::vector<std::uint16_t> joints;
    std::vector<float> weights;
    for (const int v : rows) {
      Eigen::RowVector4d w = binding.weights.row(v).cwiseMax(0);
      w /= w.sum();
      for (int k = 0; k < 4; ++k) {
        weights.push_back(float(w[k]));
        // A weight of 0 belongs to joint 0, says the format.
        joints.push_back(
            weights.back() == 0 ? 0 : std::uint16_t(prepared.cage.tets(binding.tet_from_vertex[v], k)));
      }
    }
    attributes["JOINTS_0"] = gltf_.accessor_alone(joints, 4, Gltf::vertex_attributes);
    attributes["WEIGHTS_0"] = gltf_.accessor_alone(weights, 4, Gltf::vertex_attributes);
    if ((binding.weights.array() < 0).any()) warn_of_error(b);
  }

  void warn_of_error(int b) const {
    const PreparedBody& prepared = motion_.bodies[std::size_t(b)];
    const Points rest = surface_at_rest(motion_.world.bodies[std::size_t(b)], prepared);
    const Weights kept = prepared.binding.weights.cwiseMax(0);
    double farthest = 0;
    for (const int f : motion_.wanted) {
      const Points cage = fem::body_positions(motion_.world, motion_.frames[std::size_t(f)], b);
      const std::vector<Eigen::Matrix3d> maps = maps_of_nodes(b, prepared.gradients, cage);
      for (Eigen::Index v = 0; v < kept.rows(); ++v) {
        if (prepared.binding.weights.row(v).minCoeff() >= 0) continue;
        Vec3 error = Vec3::Zero();
        for (int k = 0; k < 4; ++k) {
          const int node = prepared.cage.tets(prepared.binding.tet_from_vertex[v], k);
          const Vec3 from_node = (rest.row(v) - prepared.cage.positions.row(node)).transpose();
          error += (kept(v, k) / kept.row(v).sum() - prepared.binding.weights(v, k)) *
                   (cage.row(node).transpose() + maps[std::size_t(node)] * from_node);
        }
        farthest = std::max(farthest, error.norm());
      }
    }
    if (farthest < 1e-6 * motion_.world.bounds_m.diagonal()) return;  // float32 is no finer
    log::warn(
        "bodies.{}: vertices outside its cage have negative weights, which glTF does not know; in motion.glb "
        "they are up to {:.3g} m from where limber shows them",
        motion_.scene.bodies[std::size_t(b)].name, farthest);
  }

  bool bends(int b) const { return motion_.bodies[std::size_t(b)].deformation == scenes::Deformation::phong; }

  // The surface is the mean, by the binding's weights, of maps X ↦ x + L (X − X⁰), one a node of the cage: L
  // is 1 in linear deformation and ½ F in Phong's.
  std::vector<Eigen::Matrix3d> maps_of_nodes(int b, const NodeGradients& gradients,
                                             const Points& cage) const {
    std::vector<Eigen::Matrix3d> maps(std::size_t(cage.rows()), Eigen::Matrix3d::Identity());
    if (!bends(b)) return maps;
    const ffd::Gradients f = ffd::node_deformation_gradients(gradients, cage);
    for (std::size_t n = 0; n < maps.size(); ++n)
      maps[n] = 0.5 * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&f(Eigen::Index(n), 0));
    return maps;
  }

  // A joint for the body as a whole, which turns normals with it, and below it one for each node of the cage,
  // with that node's map. A joint can turn, scale and shift only, so a map that does more takes a second
  // joint: the one above turns by U and scales, the one below it turns by Vᵀ.
  void add_skin(int mesh_node, int b, const Points& rest, const std::vector<Points>& cages,
                const std::vector<Pose>& poses) {
    const std::string& name = motion_.world.bodies[std::size_t(b)].name;
    const Eigen::Index count = rest.rows();
    std::vector<int> joints, upper;
    for (Eigen::Index n = 0; n < count; ++n) {
      Json node{{"translation", {rest(n, 0), rest(n, 1), rest(n, 2)}}};
      if (bends(b)) {
        joints.push_back(gltf_.add("nodes", Json::object()));
        node["scale"] = {0.5, 0.5, 0.5};
        node["children"] = {joints.back()};
      }
      upper.push_back(gltf_.add("nodes", node));
    }
    if (!bends(b)) joints = upper;
    const int root = add_root({{"name", name + ".cage"}, {"children", upper}});
    animate(root, poses);

    std::vector<Points> places;  // (nodes × 3) a frame, as seen from the body's joint
    for (std::size_t f = 0; f < cages.size(); ++f)
      places.push_back((cages[f].rowwise() - poses[f].shift.transpose()) * poses[f].turn.toRotationMatrix());
    gltf_.begin_view(Gltf::none);
    for (Eigen::Index n = 0; n < count; ++n) {
      std::vector<float> shifts;
      for (const Points& place : places)
        for (int k = 0; k < 3; ++k) shifts.push_back(float(place(n, k)));
      animate(upper[std::size_t(n)], "translation", gltf_.accessor(shifts, 3));
    }
    if (bends(b)) animate_stretches(b, upper, joints, rest, places);
    std::vector<float> inverse_bind;
    for (Eigen::Index n = 0; n < count; ++n) {
      Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
      m.topRightCorner<3, 1>() = -rest.row(n).transpose().cast<float>();
      inverse_bind.insert(inverse_bind.end(), m.data(), m.data() + 16);
    }
    gltf_.document["nodes"][std::size_t(mesh_node)]["skin"] =
        gltf_.add("skins", {{"skeleton", root},
                            {"joints", joints},
                            {"inverseBindMatrices", gltf_.accessor_alone(inverse_bind, 16, Gltf::none)}});
  }

  void animate_stretches(int b, const std::vector<int>& upper, const std::vector<int>& lower,
                         const Points& rest, const std::vector<Points>& places) {
    struct Channels {
      std::vector<float> outer, scale, inner;
      Stretch last;
    };
    std::vector<Channels> channels(upper.size());
    const NodeGradients gradients = node_gradients({rest, motion_.bodies[std::size_t(b)].cage.tets});  // y up
    for (const Points& place : places) {
      throw_if_stopped();
      const std::vector<Eigen::Matrix3d> maps = maps_of_nodes(b, gradients, place);
      for (std::size_t n = 0; n < maps.size(); ++n) {
        Channels& c = channels[n];
        c.last = stretch_of(maps[n], c.last);
        append(c.outer, Eigen::Quaterniond(c.last.outer));
        append(c.inner, Eigen::Quaterniond(c.last.inner).conjugate());
        for (int k = 0; k < 3; ++k) c.scale.push_back(float(c.last.scale[k]));
      }
    }
    gltf_.begin_view(Gltf::none);
    for (std::size_t n = 0; n < channels.size(); ++n) {
      animate(upper[n], "rotation", gltf_.accessor(channels[n].outer, 4));
      animate(upper[n], "scale", gltf_.accessor(channels[n].scale, 3));
      animate(lower[n], "rotation", gltf_.accessor(channels[n].inner, 4));
    }
  }

  void animate(int node, const std::vector<Pose>& poses) {
    std::vector<float> turns, shifts;
    for (const Pose& pose : poses) {
      append(turns, pose.turn);
      for (int k = 0; k < 3; ++k) shifts.push_back(float(pose.shift[k]));
    }
    animate(node, "rotation", gltf_.accessor_alone(turns, 4, Gltf::none));
    animate(node, "translation", gltf_.accessor_alone(shifts, 3, Gltf::none));
  }
  void animate(int node, const char* path, int values) {
    Json& samplers = animation_["samplers"];
    animation_["channels"].push_back(
        {{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers.push_back({{"input", times_}, {"interpolation", "LINEAR"}, {"output", values}});
  }

  const PlannedMotion& motion_;
  Gltf gltf_;
  int times_;
  Json animation_;
  std::vector<int> roots_;
};

}  // namespace

WrittenFiles write_gltf(const PlannedMotion& motion, const fs::path& folder) {
  GltfWriter writer(motion);
  for (int b = 0; b < int(motion.bodies.size()); ++b) writer.add(b);
  const std::string content = writer.binary();
  write_file(folder / "motion.glb", content);
  return {folder / "motion.glb", 1, content.size()};
}

}  // namespace limber::detail
