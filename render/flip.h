#pragma once

#include <vector>

#include "render/image.h"

namespace medulla {

// How many pixels one degree of vision holds: a 0.7 m wide monitor of 3840 pixels, looked at from 0.7 m (the paper's).
constexpr float kFlipPixelsPerDegree = 67.02f;

// FLIP (Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference Evaluator for
// Alternating Images", HPG 2020): what a viewer sees who flips between two pictures of the same size, per pixel in
// 0..1, top row first. 0 where they are equal, 1 between fields of pure green and pure blue; the order of the two does
// not matter.
std::vector<float> flipErrors(const Image& a, const Image& b, float pixelsPerDegree = kFlipPixelsPerDegree);

// Mean of flipErrors(): the paper's single number.
double flipMean(const Image& a, const Image& b, float pixelsPerDegree = kFlipPixelsPerDegree);

}  // namespace medulla
