#include "core/appearance_file.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/json_shape.h"
#include "core/npz.h"

namespace limber {

namespace {

constexpr const char* format = "limber appearance 1";
constexpr const char* remedy = "renew it with `limber prepare`";

void require_looks(bool good, const fs::path& path, const std::string& why) {
  if (!good) throw InputError(fmt::format("{}: {}; {}", path.string(), why, remedy));
}

NpyArray floats_of(const auto& rows) {
  using Row =
      Eigen::Matrix<float, Eigen::Dynamic, std::decay_t<decltype(rows)>::ColsAtCompileTime, Eigen::RowMajor>;
  return NpyArray::of_matrix(Row(rows.template cast<float>()));
}

// Three rows a triangle, or none.
template <class Rows>
Rows rows_of(const Npz& file, const char* name, Eigen::Index triangles) {
  if (!file.arrays.contains(name)) return {};
  const NpyArray& array = file.array(name);
  constexpr int columns = Rows::ColsAtCompileTime;
  require_looks(array.shape == std::vector<std::int64_t>{3 * triangles, columns}, file.source,
                fmt::format("{} has another shape than {} × {}", name, 3 * triangles, columns));
  using Floats = Eigen::Matrix<float, Eigen::Dynamic, columns, Eigen::RowMajor>;
  return Eigen::Map<const Floats>(array.as<float>(name).data(), 3 * triangles, columns)
      .template cast<double>();
}

std::string image_file(std::size_t image, const char* extension) {
  return fmt::format("image-{}{}", image, extension);
}

}  // namespace

std::string name_of_image_file(const Appearance& a, std::size_t image) {
  return image_file(image, extension_of_image(a.images[image].bytes).c_str());
}

bool is_name_of_image_file(const std::string& name) {
  for (std::size_t i = 0; i < max_images; ++i)
    for (const char* extension : {".png", ".jpg"})
      if (name == image_file(i, extension)) return true;
  return false;
}

std::vector<std::string> write_appearance(const fs::path& folder, const Appearance& a,
                                          const SurfaceMesh& surface) {
  if (a.empty()) return {};
  validate(a, surface.triangles.rows(), "appearance");
  Npz file;
  if (a.uv.rows() > 0) file.arrays["uv"] = floats_of(a.uv);
  if (a.colors.rows() > 0) file.arrays["colors"] = floats_of(a.colors);
  file.arrays["material_from_triangle"] =
      NpyArray::of(std::span<const std::int32_t>(a.material_from_triangle), {surface.triangles.rows()});
  Json meta{{"format", format},
            {"surface_hash", hex(hash_of(surface))},
            {"materials", Json::array()},
            {"images", Json::array()}};
  for (const SurfaceMaterial& m : a.materials)
    meta["materials"].push_back({{"name", m.name},
                                 {"color", {m.color.x(), m.color.y(), m.color.z()}},
                                 {"image", m.image},
                                 {"normal_image", m.normal_image}});
  std::vector<std::string> names{appearance_file};
  for (std::size_t i = 0; i < a.images.size(); ++i) {
    names.push_back(name_of_image_file(a, i));
    meta["images"].push_back({{"name", a.images[i].name}, {"file", names.back()}});
    write_file(folder / names.back(), a.images[i].bytes);
  }
  file.texts["meta.json"] = meta.dump(2) + "\n";
  write_npz(folder / appearance_file, file);
  return names;
}

Appearance read_appearance(const fs::path& folder, const SurfaceMesh& surface) {
  const fs::path path = folder / appearance_file;
  const Npz file = read_npz(path);
  file.require_only({"uv", "colors", "material_from_triangle"}, {"meta.json"});
  const Json meta = parse_json(file.text("meta.json"), path.string() + ": meta.json");
  const Eigen::Index triangles = surface.triangles.rows();
  Appearance a;
  a.uv = rows_of<Uvs>(file, "uv", triangles);
  a.colors = rows_of<Points>(file, "colors", triangles);
  const NpyArray& materials = file.array("material_from_triangle");
  require_looks(materials.shape == std::vector<std::int64_t>{triangles}, path,
                "material_from_triangle has another length than the surface has triangles");
  const auto of_triangle = materials.as<std::int32_t>("material_from_triangle");
  a.material_from_triangle.assign(of_triangle.begin(), of_triangle.end());
  try {
    require_like(meta,
                 {{"format", ""},
                  {"surface_hash", ""},
                  {"materials", {{{"name", ""}, {"color", {0.5}}, {"image", -1}, {"normal_image", -1}}}},
                  {"images", {{{"name", ""}, {"file", ""}}}}},
                 Keys::all, path.string() + ": meta.json", remedy);
    require_looks(meta.at("format") == format && meta.size() == 4, path,
                  "it is not of this version's format");
    require_looks(meta.at("surface_hash") == hex(hash_of(surface)), path, "it was made for another surface");
    for (const Json& m : meta.at("materials")) {
      require_looks(m.size() == 4 && m.at("color").size() == 3, path, "a material that limber did not write");
      a.materials.push_back({m.at("name").get<std::string>(),
                             Vec3(m.at("color")[0], m.at("color")[1], m.at("color")[2]),
                             m.at("image").get<int>(), m.at("normal_image").get<int>()});
    }
    require_looks(meta.at("images").size() <= max_images, path, "more images than limber writes");
    for (const Json& image : meta.at("images")) {
      const auto name = image.at("file").get<std::string>();
      const std::size_t i = a.images.size();
      require_looks(image.size() == 2 && (name == image_file(i, ".png") || name == image_file(i, ".jpg")),
                    path, fmt::format("image {} is in a file that limber did not write", i));
      a.images.push_back({image.at("name").get<std::string>(), read_file(folder / name, max_image_bytes)});
      require_looks(name == name_of_image_file(a, i), folder / name, "is no image of that kind");
    }
  } catch (const Json::exception& trouble) {
    require_looks(false, path, "meta.json: " + words_of(trouble));
  }
  validate(a, triangles, path.string());
  return a;
}

void remove_appearance(const fs::path& folder) {
  std::error_code ignored;
  fs::remove(folder / appearance_file, ignored);
  for (const fs::directory_entry& file : fs::directory_iterator(folder, ignored))
    if (is_name_of_image_file(file.path().filename().string())) fs::remove(file.path(), ignored);
}

}  // namespace limber
