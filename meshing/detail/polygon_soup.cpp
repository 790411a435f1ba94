#include "meshing/detail/polygon_soup.h"

#include <algorithm>
#include <limits>

#include "core/error.h"

namespace limber::meshing::detail {

namespace {

constexpr std::size_t most = std::size_t(std::numeric_limits<int>::max()) / 3;

void require_room(std::size_t count, const char* what) {
  if (count >= most) throw InputError(fmt::format("more than {} {}: split the model", most, what));
}

}  // namespace

int PolygonSoup::add_position(const Vec3& p) {
  require_room(positions.size(), "vertices");
  positions.push_back(p);
  return int(positions.size()) - 1;
}

void PolygonSoup::add_corner(int vertex) {
  require_room(corners.size(), "corners of faces");
  corners.push_back(vertex);
}

void PolygonSoup::end_polygon() { first_corner.push_back(int(corners.size())); }

int PolygonSoup::add_image(NamedImage image) {
  const auto [at, fresh] = image_from_path.try_emplace(image.path, int(images.size()));
  if (fresh) images.push_back(std::move(image));
  return at->second;
}

void PolygonSoup::note_single_precision() {
  double farthest = 0;
  for (const Vec3& p : positions)
    if (p.allFinite()) farthest = std::max(farthest, p.cwiseAbs().maxCoeff());
  rounding = farthest * 0x1p-24;
}

void PolygonSoup::require_indices(const std::string& file) const {
  for (int i = 0; i < polygon_count(); ++i)
    for (int c = first_corner[i]; c < first_corner[i + 1]; ++c)
      if (corners[c] < 0 || corners[c] >= int(positions.size()))
        throw InputError(
            fmt::format("{}: face {} (counted from 0) names vertex {} (counted from 0), but there are {} "
                        "vertices; the file is "
                        "damaged or cut short, write it again",
                        file, i, corners[c], positions.size()));
}

}  // namespace limber::meshing::detail
