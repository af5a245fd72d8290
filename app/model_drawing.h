#pragma once

#include "app/shown_parts.h"
#include "app/simulation.h"
#include "render/renderer.h"

// What is shown of the model and of the haptics, after the paper's figures 1, 2, 3, 8, 10 and 11.
namespace medulla {

// m, world: of a filling sphere's ball.
Eigen::Vector3d ballCentre(const FillingSphere& sphere, const SpherePose& pose);

// Adds the chosen parts of a body in its present shape. `height`: of the picture at what it looks at, m; thin things
// are as wide in it whatever the body's size.
void drawBodyModel(const SceneBody& body, const BodyFrame& frame, const Shown& shown, float height, Drawing& out);

// Adds the proxy, the device, and the virtual spring between them as a coil.
void drawProxy(const ToolSettings& tool, const ToolState& state, Drawing& out);

}  // namespace medulla
