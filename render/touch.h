#pragma once

#include "render/renderer.h"
#include "render/scene_mesh.h"

namespace medulla {

// Where an instrument touches: the tissue around its tip is pressed in softly along the instrument and loses its blood.
// Changes positions, normals and blanch of the surfaces.
void applyTouch(const Instrument& instrument, SceneMesh& mesh);

}  // namespace medulla
