#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace medulla {

// 8-bit RGBA picture, top row first, sRGB.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  // 4 * width * height
};

Image blackImage(int width, int height);  // opaque
// Every row of `part` over that of `whole`, from column `x` on; as high, and no wider than what is left.
void copyInto(const Image& part, int x, Image& whole);

// PNG with the text chunks given (keyword, text). Written beside `path` and renamed when whole.
// Throws std::runtime_error with the path and the reason.
struct PngText {
  std::string keyword, text;
};
void writePng(const std::string& path, const Image& image, const std::vector<PngText>& texts = {});
// What writePng() writes.
std::string encodePng(const Image& image, const std::vector<PngText>& texts = {});
bool isPng(const std::string& path);  // as far as its first bytes tell; false where it cannot be read
// Throws std::runtime_error when the file is missing or no PNG. `texts`, if given, receives the tEXt chunks.
Image readPng(const std::string& path, std::vector<PngText>* texts = nullptr);

// How far two pictures of the same size are apart; a pixel's difference is that of its worst channel.
struct ImageDifference {
  double overFourPercent = 0;  // % of pixels off by more than 4
  long overSixteen = 0;        // pixels off by more than 16
  double psnr = 0;             // dB over RGB; +infinity when equal
  bool equal = false;          // every byte
};
ImageDifference compareImages(const Image& a, const Image& b);
// Second tier of the golden gate: noise of another instruction set passes, a missing shadow does not.
bool withinTolerance(const ImageDifference& d);  // <= 0.05 % over 4, <= 5 pixels over 16, PSNR >= 50 dB
Image amplifiedDifference(const Image& a, const Image& b, int gain);

// The sRGB transfer (IEC 61966-2-1) of a channel, 0 to 1 both.
double lightFromSrgb(double shown);
double srgbFromLight(double light);

}  // namespace medulla
