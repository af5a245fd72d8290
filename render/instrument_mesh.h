#pragma once

#include "render/renderer.h"
#include "render/scene_mesh.h"

namespace medulla {

// Appends the parts of one laparoscopic grasper (shaft 5 mm across, toothed jaws) in the pose given: steel and black
// sheath, world frame, with everything the tissue shader needs. eye: the camera's position, m.
void appendInstrument(const Instrument& instrument, glm::vec3 eye, SceneMesh& mesh);
// Drops every part appended so far.
void removeInstruments(SceneMesh& mesh);

}  // namespace medulla
