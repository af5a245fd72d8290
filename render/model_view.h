#pragma once

#include <array>
#include <vector>

#include "render/renderer.h"
#include "render/viewpoint.h"

namespace medulla {

// Takes colours towards the backdrop's with depth, from the nearest of a drawing to its farthest.
struct DepthFade {
  float near = 0, far = 0;  // m
  glm::vec4 operator()(glm::vec4 colour, float depth) const;
};

// Before the backdrop what is far takes its colour; within the scene tissue is drawn over the model; as an overlay
// nothing is too thin to be seen.
enum class ModelPlace { backdrop, scene, overlay };

// Draws what is shown of the model (paper, figures 1, 2, 8, 10 and 11) with instanced unit meshes. Needs a current
// context.
class ModelView {
 public:
  explicit ModelView(int pictureHeight);  // px
  ~ModelView();
  ModelView(const ModelView&) = delete;
  ModelView& operator=(const ModelView&) = delete;

  void drawBackdrop() const;
  void draw(const Viewpoint& viewpoint, const Drawing& drawing, ModelPlace place);
  // Of the last drawing, what is too thin to be opaque: last, over skins and balls that hide its far side.
  void drawFaint(const Viewpoint& viewpoint) const;

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
  struct SeenThrough {
    float depth;
    std::size_t level;
    Instance instance;
  };
  static UnitMesh makeUnitMesh(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals,
                               const std::vector<unsigned>& indices);
  static UnitMesh makeSphere(int rings);
  static UnitMesh makeCylinder(int sides);
  static UnitMesh makeCone(int sides);
  static Instance rodInstance(glm::vec3 a, glm::vec3 b, float radius, glm::vec4 colour);
  static Instance ballInstance(glm::vec3 centre, float radius, glm::vec4 colour);
  void sortBalls(const Viewpoint& viewpoint, const std::vector<DrawnBall>& balls, const DepthFade& fade);
  void placeRods(const Viewpoint& viewpoint, const Drawing& drawing, const DepthFade& fade, bool allOpaque);
  float atLeast(const Viewpoint& viewpoint, float depth, float radius) const;
  void drawInstances(const UnitMesh& mesh, const std::vector<Instance>& instances) const;
  void drawBallsSeenThrough(bool hide) const;
  // Lines: lit as if they faced the eye, and moved some way towards it: they look the same, but less lies before them.
  void setCamera(const Viewpoint& viewpoint, bool lines = false) const;

  float pixel_;  // of the picture's height
  unsigned program_ = 0, backdropProgram_ = 0, emptyArray_ = 0;
  std::array<UnitMesh, 3> spheres_;   // coarse to fine: the silhouette's error stays below a third of a pixel
  UnitMesh cylinder_, shaft_, cone_;  // shaft_: a cylinder for arrows, round from near
  std::array<std::vector<Instance>, 3> opaque_, dense_;  // dense_: of those seen through, what hides faint rods
  std::vector<SeenThrough> seenThrough_;
  std::vector<Instance> rods_, faintRods_, shafts_, heads_;
};

}  // namespace medulla
