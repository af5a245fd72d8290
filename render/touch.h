#pragma once

#include "render/renderer.h"
#include "render/scene_mesh.h"

namespace medulla {

// Where an instrument touches: the tissue around its tip is pressed in softly along the instrument and loses its blood.
// Changes positions, normals and blanch of the surfaces.
void applyTouch(const Instrument& instrument, SceneMesh& mesh);

// The instrument's contact shadow: it hides part of the cavity from the surfaces near it. The lamp beside the lens
// throws its own shadow almost behind the instrument. Scales openness by 1 - r/d cos, what a long cylinder of radius r
// at distance d leaves (view factor from a small patch to a cylinder; Howell's catalogue, B-32), fading out at 5 cm.
void shadeAround(const Instrument& instrument, SceneMesh& mesh);

}  // namespace medulla
