#include "core/contact_shape_file.h"

#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/npz.h"

namespace limber {

namespace {

constexpr std::int64_t max_nodes_on_an_axis = 1 << 14, max_nodes = 1 << 26, max_samples = 1 << 20;
constexpr double longest_m = 1e9;  // beyond any coordinate or distance

void require(bool good, const fs::path& path, const std::string& why) {
  if (!good) throw InputError(fmt::format("{}: {}; renew it with `limber prepare`", path.string(), why));
}

void require_hash(const Json& meta, const char* mesh, std::uint64_t now, const fs::path& path) {
  const std::string then = meta.at(std::string(mesh) + "_hash").get<std::string>();
  require(then == hex(now), path,
          fmt::format("it was made for another {} (hash {}, now {})", mesh, then, hex(now)));
}

bool within(double value, double least, double most) { return value >= least && value <= most; }

// The rows of a float64 array of `columns`, as a matrix.
template <class Matrix>
Matrix matrix_of(const Npz& file, const char* name, std::int64_t rows, std::int64_t columns) {
  const NpyArray& array = file.array(name);
  std::vector<std::int64_t> shape{rows};
  if (Matrix::ColsAtCompileTime != 1) shape.push_back(columns);
  require(array.shape == shape, file.source,
          fmt::format("{} has another shape than {} × {}", name, rows, columns));
  const Matrix matrix = Eigen::Map<const Matrix>(array.as<double>(name).data(), rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i)
    require(within(matrix.data()[i], -longest_m, longest_m), file.source,
            fmt::format("row {} of {} holds {}", i / columns, name, matrix.data()[i]));
  return matrix;
}

DistanceField field_of(const Npz& file, const Json& meta) {
  DistanceField field;
  const auto lower = meta.at("lower_m").get<std::array<double, 3>>();
  field.lower_m = {lower[0], lower[1], lower[2]};
  meta.at("cell_m").get_to(field.cell_m);
  meta.at("unit_m").get_to(field.unit_m);
  require(field.lower_m.cwiseAbs().maxCoeff() <= longest_m, file.source, "lower_m is beyond any model");
  require(within(field.cell_m, 1e-30, longest_m), file.source, fmt::format("cell_m is {}", field.cell_m));
  require(within(field.unit_m, 1e-30, longest_m), file.source, fmt::format("unit_m is {}", field.unit_m));
  const NpyArray& values = file.array("field");
  require(values.shape.size() == 3, file.source, "field has not three axes");
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t nodes = values.shape[std::size_t(2 - axis)];
    require(nodes >= 2 && nodes <= max_nodes_on_an_axis, file.source,
            fmt::format("field has {} nodes along an axis", nodes));
    field.nodes[std::size_t(axis)] = int(nodes);
  }
  require(values.size() <= max_nodes, file.source, fmt::format("field has {} nodes", values.size()));
  const auto all = values.as<std::int16_t>("field");
  field.values.assign(all.begin(), all.end());
  return field;
}

SurfaceSamples samples_of(const Npz& file, Eigen::Index tets) {
  SurfaceSamples samples;
  const NpyArray& tet_from_sample = file.array("sample_tets");
  require(tet_from_sample.shape.size() == 1 && tet_from_sample.shape[0] <= max_samples, file.source,
          "sample_tets is no list of samples");
  const std::int64_t count = tet_from_sample.shape[0];
  samples.tet_from_sample =
      Eigen::Map<const Eigen::VectorXi>(tet_from_sample.as<std::int32_t>("sample_tets").data(), count);
  samples.positions_m = matrix_of<Points>(file, "sample_positions_m", count, 3);
  samples.weights = matrix_of<Weights>(file, "sample_weights", count, 4);
  samples.area_m2 = matrix_of<Eigen::VectorXd>(file, "sample_areas_m2", count, 1);
  for (Eigen::Index s = 0; s < count; ++s) {
    const int tet = samples.tet_from_sample[s];
    require(tet >= 0 && tet < tets, file.source,
            fmt::format("sample {} names tet {}, which is none", s, tet));
    require(s == 0 || tet >= samples.tet_from_sample[s - 1], file.source,
            fmt::format("sample {} is not in the order of tets", s));
    const double sum = samples.weights.row(s).sum();
    require(std::abs(sum - 1) <= 1e-9, file.source,
            fmt::format("the weights of sample {} sum to {}, not 1", s, sum));
    require(samples.area_m2[s] > 0, file.source,
            fmt::format("sample {} stands for {} m²", s, samples.area_m2[s]));
  }
  return samples;
}

}  // namespace

void write_contact_shape(const fs::path& path, const ContactShape& shape, const SurfaceMesh& surface,
                         const TetMesh& cage) {
  const DistanceField& field = shape.field;
  Npz file;
  file.arrays["field"] = NpyArray::of(std::span<const std::int16_t>(field.values),
                                      {field.nodes[2], field.nodes[1], field.nodes[0]});
  file.arrays["sample_positions_m"] = NpyArray::of_matrix(shape.samples.positions_m);
  file.arrays["sample_tets"] = NpyArray::of_matrix(shape.samples.tet_from_sample);
  file.arrays["sample_weights"] = NpyArray::of_matrix(shape.samples.weights);
  file.arrays["sample_areas_m2"] = NpyArray::of_matrix(shape.samples.area_m2);
  file.arrays["least_weight"] = NpyArray::of_matrix(shape.min_weight);
  Json meta;
  meta["format"] = "limber contact 1";
  meta["surface_hash"] = hex(hash_of(surface));
  meta["cage_hash"] = hex(hash_of(cage));
  meta["usable"] = shape.usable;
  meta["lower_m"] = {field.lower_m.x(), field.lower_m.y(), field.lower_m.z()};
  meta["cell_m"] = field.cell_m;
  meta["unit_m"] = field.unit_m;
  file.texts["meta.json"] = meta.dump(2) + "\n";
  write_npz(path, file);
}

ContactShape read_contact_shape(const fs::path& path, const SurfaceMesh& surface, const TetMesh& cage) {
  const Npz file = read_npz(path);
  file.require_only(
      {"field", "sample_positions_m", "sample_tets", "sample_weights", "sample_areas_m2", "least_weight"},
      {"meta.json"});
  const Json meta = parse_json(file.text("meta.json"), path.string() + ": meta.json");
  ContactShape shape;
  try {
    require(meta.at("format") == "limber contact 1", path, "it is not of this version's format");
    require_hash(meta, "surface", hash_of(surface), path);
    require_hash(meta, "cage", hash_of(cage), path);
    meta.at("usable").get_to(shape.usable);
    shape.field = field_of(file, meta);
    require(meta.size() == 7, path, "meta.json has more in it than limber writes");
  } catch (const Json::exception& trouble) {
    require(false, path, "meta.json: " + words_of(trouble));
  }
  shape.samples = samples_of(file, cage.tets.rows());
  require(!shape.usable || shape.samples.tet_from_sample.size() > 0, path, "it has no samples");
  shape.min_weight = matrix_of<Weights>(file, "least_weight", cage.tets.rows(), 4);
  for (Eigen::Index i = 0; i < shape.min_weight.size(); ++i)
    require(within(shape.min_weight.data()[i], 0, 2), path,
            fmt::format("least_weight of tet {} is {}", i / 4, shape.min_weight.data()[i]));
  return shape;
}

}  // namespace limber
