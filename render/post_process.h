#pragma once

#include <cstdint>
#include <vector>

#include "render/image.h"

namespace medulla {

// What is done to the picture after it was read back: a fraction of what it would cost in software OpenGL.
class PostProcess {
 public:
  PostProcess(int width, int height);
  void fadeRim(Image& image);      // darkens towards the endoscope's rim; black outside
  void addGlare(Image& image);     // halo around highlights, as scattered by an endoscope's lenses
  void smoothEdges(Image& image);  // FXAA (Lottes 2011) on pixels of high local contrast

 private:
  struct RimPixel {
    std::uint32_t index;
    std::uint8_t factor;  // of 255
  };
  struct Span {
    std::uint32_t first, count;  // pixels of one row
  };
  struct Smoothed {
    std::uint32_t index;
    std::uint8_t rgb[3];
  };
  void findRim();
  void gatherHighlights(const Image& image);
  void blurGlare();
  void computeLuma(const Image& image);
  std::size_t lumaIndex(int x, int y) const;
  void smoothPixel(const Image& image, int x, int y);
  void smoothRow(const Image& image, int y);

  int width_, height_;
  std::vector<RimPixel> rim_;  // where the picture fades
  std::vector<Span> outside_;  // where it is black
  std::ptrdiff_t lumaStride_;
  std::vector<std::uint8_t> luma_;   // with a margin in which the picture's outermost pixels are repeated
  std::vector<std::uint8_t> edge_;   // flags of a row, filled up with 0 to a multiple of eight
  std::vector<std::uint8_t> black_;  // a row of opaque pixels
  std::vector<Smoothed> smoothed_;
  int cellsX_, cellsY_;  // coarse grid of the halo, with a border of one empty cell
  std::vector<float> glare_, blurred_;
};

}  // namespace medulla
