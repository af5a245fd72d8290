#pragma once

#include <string>
#include <vector>

#include "render/image.h"

namespace medulla {

constexpr int kGain = 16;  // of differences that are shown

// What a picture was drawn with.
struct DrawnWith {
  std::string renderer, processor;  // GL_RENDERER and GL_VERSION; model name
};

// One moment of a scene held against its golden image; or a scene that cannot be drawn, or an image without a moment.
struct GoldenResult {
  std::string name, scene;  // <scene>_<frame>, or <scene>; the scene's file
  bool passed = false;
  std::string verdict;     // one line: figures, or why there are none
  DrawnWith stored;        // of the golden image; empty where that says nothing
  Image expected, actual;  // empty where there is nothing to look at
};

bool hasDifference(const GoldenResult& result);  // two pictures of one size

// An HTML page that needs no other file: every moment with its verdict; of those with pictures the expected and the
// actual one; of those of one size their difference amplified, and one that flickers between the two under the mouse.
// Written through OutputFile; throws as that does.
void writeGoldenReport(const std::string& path, const std::vector<GoldenResult>& results, const DrawnWith& now);

}  // namespace medulla
