#pragma once

#include "render/renderer.h"
#include "render/scene_mesh.h"
#include "render/viewpoint.h"

namespace medulla {

// m, at scale 1: of the shaft, and how far from the tip of the closed jaws it ends.
constexpr float kHinge = 0.0200f, kShaftRadius = 0.0026f, kShaftEnd = 0.42f;

// Appends the parts of one laparoscopic grasper (shaft 5 mm across, toothed jaws) in the pose given: steel and black
// sheath, world frame, with everything the tissue shader needs. pictureHeight: px.
void appendInstrument(const Instrument& instrument, const Viewpoint& view, int pictureHeight, SceneMesh& mesh);
// Drops every part appended so far.
void removeInstruments(SceneMesh& mesh);

}  // namespace medulla
