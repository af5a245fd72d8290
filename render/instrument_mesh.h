#pragma once

#include "render/renderer.h"
#include "render/scene_mesh.h"
#include "render/viewpoint.h"

namespace medulla {

// Appends the parts of one laparoscopic grasper (shaft 5 mm across, toothed jaws) in the pose given: steel and black
// sheath, world frame, with everything the tissue shader needs. pictureHeight: px.
void appendInstrument(const Instrument& instrument, const Viewpoint& view, int pictureHeight, SceneMesh& mesh);
// Drops every part appended so far.
void removeInstruments(SceneMesh& mesh);

}  // namespace medulla
