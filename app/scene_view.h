#pragma once

#include <vector>

#include "app/shown_parts.h"
#include "app/simulation.h"
#include "app/surface_smoothing.h"
#include "render/renderer.h"

// Physics to draw lists: the one place where Eigen becomes GLM.
namespace medulla {

glm::vec3 toGlm(const Eigen::Vector3d& v);

struct ViewOptions {
  std::vector<ViewKind> panels = {ViewKind::tissue};  // at least one; side by side, from the left
  Shown shown;
};

class SceneView {
 public:
  // Hands every surface of the scene to the renderer, at rest.
  SceneView(const LoadedScene& loaded, const DynamicsFrame& rest, Renderer& renderer);

  // Fills `picture` (reused) from a state.
  void compose(const PictureState& state, ViewKind view, const Shown& shown, Picture& picture) const;

 private:
  const LoadedScene* loaded_;
  float widening_;
  std::vector<SurfaceSmoothing> smoothings_;  // of each body
  std::size_t drawnStatics_ = 0;
};

// The drawn surface of a body in its present shape: `out` gets one position per render vertex (RenderSurface's comment
// has the formula).
void evaluateRenderSurface(const RenderSurface& surface, const std::vector<Eigen::Vector3d>& nodes,
                           std::vector<glm::vec3>& out);

// Camera at a time: through the keys without a step of velocity, still before the first and after the last.
Camera cameraAt(const std::vector<CameraKey>& keys, double time);
float heightAtTarget(const Camera& camera);  // m, of what the picture shows there

}  // namespace medulla
