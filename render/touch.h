#pragma once

#include <optional>

#include "render/renderer.h"
#include "render/scene_mesh.h"
#include "render/tessellation.h"

namespace medulla {

// What the part's deformation since `rest` does to its colour: stretched tissue pales, compressed tissue reddens, and
// less of the cavity's light reaches into a fold. Changes blanch and openness.
void applyStrain(const SceneMesh& rest, SceneMesh& mesh, const MeshPart& part);

// Where what the instrument holds comes up between its jaws, in a fold that meshes are too coarse for: none where it
// holds nothing.
std::optional<FineSpot> spotBetweenJaws(const Instrument& instrument, const SceneMesh& mesh);

// Where an instrument touches: the tissue around its tip is pressed in softly along the instrument and loses its blood.
// What a closed grip holds comes up between its jaws instead. Changes positions, normals, openness and blanch of the
// surfaces.
void applyTouch(const Instrument& instrument, SceneMesh& mesh);

// The instrument's contact shadow: it hides part of the cavity from the surfaces near it. The lamp beside the lens
// throws its own shadow almost behind the instrument. Scales openness by 1 - r/d cos, what a long cylinder of radius r
// at distance d leaves (view factor from a small patch to a cylinder; Howell's catalogue, B-32), fading out at ten
// diameters.
void shadeAround(const Instrument& instrument, SceneMesh& mesh);

}  // namespace medulla
