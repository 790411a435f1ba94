#include "ffd/binding_file.h"

#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/json_shape.h"
#include "core/npz.h"

namespace limber::ffd {

namespace {

void require(bool good, const fs::path& path, const std::string& why) {
  if (!good) throw InputError(fmt::format("{}: {}; renew it with `limber prepare`", path.string(), why));
}

void require_hash(const Json& meta, const char* mesh, std::uint64_t now, const fs::path& path) {
  const std::string then = meta.at(std::string(mesh) + "_hash").get<std::string>();
  require(then == hex(now), path,
          fmt::format("it was made for another {} (hash {}, now {})", mesh, then, hex(now)));
}

}  // namespace

void write_binding(const fs::path& path, const Binding& binding, const SurfaceMesh& surface,
                   const TetMesh& cage) {
  Npz file;
  file.arrays["tet_from_vertex"] = NpyArray::of_matrix(binding.tet_from_vertex);
  file.arrays["weights"] = NpyArray::of_matrix(binding.weights);
  Json meta;
  meta["format"] = "limber binding 1";
  meta["surface_hash"] = hex(hash_of(surface));
  meta["cage_hash"] = hex(hash_of(cage));
  meta["outside"] = binding.outside;
  meta["farthest_outside_vertex"] = binding.farthest_outside_vertex;
  meta["max_outside_distance_m"] = binding.max_outside_distance_m;
  file.texts["meta.json"] = meta.dump(2) + "\n";
  write_npz(path, file);
}

Binding read_binding(const fs::path& path, const SurfaceMesh& surface, const TetMesh& cage) {
  const Npz file = read_npz(path);
  file.require_only({"tet_from_vertex", "weights"}, {"meta.json"});
  const Json meta = parse_json(file.text("meta.json"), path.string() + ": meta.json");
  const Eigen::Index vertices = surface.positions.rows();
  Binding binding;
  try {
    require(meta.at("format") == "limber binding 1", path, "it is not of this version's format");
    require_like(meta,
                 {{"surface_hash", ""},
                  {"cage_hash", ""},
                  {"outside", -1},
                  {"farthest_outside_vertex", -1},
                  {"max_outside_distance_m", 0.5}},
                 Keys::all, path.string() + ": meta.json", "renew it with `limber prepare`");
    require(meta.size() == 6, path, "meta.json has more in it than limber writes");
    require_hash(meta, "surface", hash_of(surface), path);
    require_hash(meta, "cage", hash_of(cage), path);
    meta.at("outside").get_to(binding.outside);
    meta.at("farthest_outside_vertex").get_to(binding.farthest_outside_vertex);
    meta.at("max_outside_distance_m").get_to(binding.max_outside_distance_m);
  } catch (const Json::exception& trouble) {
    require(false, path, "meta.json: " + words_of(trouble));
  }
  require(binding.outside >= 0 && binding.outside <= vertices, path,
          fmt::format("{} vertices outside are none or more than there are", binding.outside));
  require(binding.farthest_outside_vertex >= -1 && binding.farthest_outside_vertex < vertices, path,
          fmt::format("farthest_outside_vertex is {}, which is none", binding.farthest_outside_vertex));
  require(std::isfinite(binding.max_outside_distance_m) && binding.max_outside_distance_m >= 0, path,
          fmt::format("max_outside_distance_m is {}", binding.max_outside_distance_m));
  const NpyArray &tets = file.array("tet_from_vertex"), &weights = file.array("weights");
  require(tets.shape == std::vector<std::int64_t>{vertices}, path,
          "tet_from_vertex has another length than the surface");
  require(weights.shape == std::vector<std::int64_t>{vertices, 4}, path,
          "weights has another shape than V × 4");
  binding.tet_from_vertex =
      Eigen::Map<const Eigen::VectorXi>(tets.as<std::int32_t>("tet_from_vertex").data(), vertices);
  binding.weights = Eigen::Map<const Weights>(weights.as<double>("weights").data(), vertices, 4);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const int tet = binding.tet_from_vertex[v];
    require(tet >= 0 && tet < cage.tets.rows(), path,
            fmt::format("vertex {} names tet {}, which is none", v, tet));
    const double sum = binding.weights.row(v).sum();
    require(std::abs(sum - 1) <= 1e-9, path,
            fmt::format("the weights of vertex {} sum to {}, not 1", v, sum));
  }
  return binding;
}

void write_interp(const fs::path& path, const Binding& binding, const Tets& tets) {
  std::string text;
  for (Eigen::Index v = 0; v < binding.tet_from_vertex.size(); ++v) {
    fmt::format_to(std::back_inserter(text), "{}", v);
    for (int k = 0; k < 4; ++k)
      fmt::format_to(std::back_inserter(text), " {} {}", tets(binding.tet_from_vertex[v], k),
                     binding.weights(v, k));
    text += '\n';
  }
  write_file(path, text);
}

}  // namespace limber::ffd
