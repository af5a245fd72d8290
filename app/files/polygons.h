#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// Faces of four corners and more while a file is read: fans about their first corners until all vertices are known,
// some of which may come after the faces.
class Polygons {
 public:
  // Appends the fan; `corners`: at least 3.
  void add(const std::vector<int>& corners, TriangleMesh& mesh);
  // Of concave polygons a fan may fold over itself, and then a sound mesh would seem to cut through itself: these are
  // cut into ears instead (Meisters 1975), in the same triangles' places. Indices are valid.
  // Throws std::runtime_error "FILE: ..." where such a polygon has more than a thousand corners.
  void cutConcave(const std::string& file, TriangleMesh& mesh) const;

 private:
  struct Fan {
    std::size_t firstTriangle;
    int corners;
  };
  std::vector<Fan> fans_;
};

}  // namespace medulla
