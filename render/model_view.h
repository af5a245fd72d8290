#pragma once

#include <array>
#include <vector>

#include "render/renderer.h"
#include "render/viewpoint.h"

namespace medulla {

// Draws balls and segments of the model (paper, figures 2 and 11) with instanced unit meshes. Needs a current context.
class ModelView {
 public:
  ModelView();
  ~ModelView();
  ModelView(const ModelView&) = delete;
  ModelView& operator=(const ModelView&) = delete;

  void drawBackdrop() const;
  void draw(const Viewpoint& viewpoint, const std::vector<DrawnBall>& balls, const std::vector<Segment>& segments);
  void drawArrows(const Viewpoint& viewpoint, const std::vector<Arrow>& arrows);  // before all that was drawn so far

 private:
  // Rows of the 3x4 matrix that places the unit mesh, and a colour.
  struct Instance {
    glm::vec4 row[3];
    glm::vec4 colour;
  };
  struct UnitMesh {
    unsigned vertexArray = 0, vertices = 0, indices = 0, instances = 0;
    int indexCount = 0;
  };
  static UnitMesh makeUnitMesh(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
                               const std::vector<unsigned>& indices);
  static UnitMesh makeSphere(int rings);
  static UnitMesh makeCylinder(int sides);
  static UnitMesh makeCone(int sides);
  static Instance rodInstance(glm::vec3 a, glm::vec3 b, float radius, glm::vec4 colour);
  void drawInstances(const UnitMesh& mesh, const std::vector<Instance>& instances) const;
  void setCamera(const Viewpoint& viewpoint) const;

  unsigned program_ = 0, backdropProgram_ = 0, emptyArray_ = 0;
  std::array<UnitMesh, 3> spheres_;   // coarse to fine: the silhouette's error stays below a third of a pixel
  UnitMesh cylinder_, shaft_, cone_;  // shaft_: a cylinder for arrows, round from near
};

}  // namespace medulla
