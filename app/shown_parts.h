#pragma once

#include <string>
#include <vector>

namespace medulla {

// What a picture shows beside skins.
struct Shown {
  // Of the model, in views that are not skins alone.
  bool mesh = false, skeleton = false, spheres = false, buckets = false, links = false, frames = false,
       attachments = false;
  // In every view.
  bool proxy = false, force = false, caption = false;
};

struct ShownPart {
  const char* name;
  bool Shown::*part;
  bool ofModel;
  const char* meaning;
};
const std::vector<ShownPart>& shownParts();  // in the order of help and run hashes

// Of the model what is named, or where nothing of it is: mesh, spheres and links. Throws
// std::invalid_argument on an unknown name, with the known ones and the nearest.
Shown readShown(const std::vector<std::string>& names);

std::string namesOf(const Shown& shown);  // comma-separated; what readShown() would need

bool namesModelPart(const std::vector<std::string>& names);

}  // namespace medulla
