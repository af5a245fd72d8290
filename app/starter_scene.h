#pragma once

#include <string>

#include "physics/model/soft_body_model.h"

namespace medulla {

struct StarterScene {
  std::string scene;       // XML
  std::string trajectory;  // CSV
};

// A scene around a model that someone brought, to be edited further: the body is held at one end (the upper one where
// it stands), a tool presses it, grabs it, pulls it by a fifth of its size, twists it and lets go, and a camera in
// front sees all of it. `name` is the body's and the scene's; the scene expects NAME.model.xml and NAME.csv beside
// itself. Needs no more than a model that medulla build made.
StarterScene starterScene(const std::string& name, const SoftBodyModel& model);

}  // namespace medulla
