#include "meshing/detail/tet_faces.h"

#include <algorithm>
#include <tuple>

#include "meshing/detail/edges.h"

namespace limber::meshing::detail {

std::vector<TetFace> tet_faces(const Tets& tets) {
  std::vector<TetFace> faces;
  faces.reserve(std::size_t(tets.size()));
  for (int t = 0; t < tets.rows(); ++t)
    for (int corner = 0; corner < 4; ++corner) {
      TetFace face{{}, t, corner};
      for (int k = 0, n = 0; k < 4; ++k)
        if (k != corner) face.vertices[n++] = tets(t, k);
      std::sort(face.vertices.begin(), face.vertices.end());
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(), [](const TetFace& a, const TetFace& b) {
    return std::tie(a.vertices, a.tet) < std::tie(b.vertices, b.tet);
  });
  return faces;
}

std::vector<int> components(const Tets& tets) {
  UnionFind groups(int(tets.rows()));
  const std::vector<TetFace> faces = tet_faces(tets);
  for (std::size_t i = 1; i < faces.size(); ++i)
    if (faces[i].vertices == faces[i - 1].vertices) groups.join(faces[i].tet, faces[i - 1].tet);
  std::vector<int> lowest(std::size_t(tets.rows()));
  for (int t = 0; t < tets.rows(); ++t) lowest[t] = groups.root(t);
  return lowest;
}

}  // namespace limber::meshing::detail
