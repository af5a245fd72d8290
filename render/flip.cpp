#include "render/flip.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <numeric>

// Sections and equations are those of the paper. Colours: R linear RGB, X CIE XYZ, O the opponent space YyCxCz.
namespace medulla {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Section 4.1: contrast sensitivity as sums of two Gaussians a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees (table 1).
struct Gaussian {
  float a, b;
};
constexpr Gaussian kAchromatic{1, 0.0047f}, kRedGreen{1, 0.0053f}, kBlueYellow[2] = {{34.1f, 0.04f}, {13.5f, 0.025f}};
constexpr float kWidest = 0.04f;
// Section 4.1.3: exponent on colour differences, and where its range is bent: 0.4 of the largest becomes 0.95.
constexpr float kColourExponent = 0.7f, kBendAt = 0.4f, kBendTo = 0.95f;
// Section 4.2: width of the edges and points that count, degrees, and the exponent on their difference.
constexpr float kFeatureWidth = 0.082f, kFeatureExponent = 0.5f;

// sRGB primaries and D65 (IEC 61966-2-1), by columns.
const glm::mat3 kXyzFromRgb{0.4124564f, 0.2126729f, 0.0193339f, 0.3575761f, 0.7151522f,
                            0.1191920f, 0.1804375f, 0.0721750f, 0.9503041f};
const glm::mat3 kRgbFromXyz = glm::inverse(kXyzFromRgb);
const glm::vec3 kWhite = kXyzFromRgb * glm::vec3(1);

glm::vec3 opponentFromRgb(const glm::vec3& rgb) {
  const glm::vec3 x = kXyzFromRgb * rgb / kWhite;
  return {116 * x.y - 16, 500 * (x.x - x.y), 200 * (x.y - x.z)};
}
glm::vec3 rgbFromOpponent(const glm::vec3& o) {
  const float y = (o.x + 16) / 116;
  return kRgbFromXyz * (kWhite * glm::vec3(y + o.y / 500, y, y - o.z / 200));
}

// CIE L*a*b* of a linear RGB inside the cube, with the Hunt effect: chroma counts less in the dark (section 4.1.2).
glm::vec3 huntLabFromRgb(const glm::vec3& rgb) {
  const glm::vec3 x = kXyzFromRgb * glm::clamp(rgb, 0.f, 1.f) / kWhite;
  const auto f = [](float t) {
    constexpr float delta = 6 / 29.f;
    return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4 / 29.f;
  };
  const float fx = f(x.x), fy = f(x.y), fz = f(x.z), lightness = 116 * fy - 16;
  return {lightness, 0.01f * lightness * 500 * (fx - fy), 0.01f * lightness * 200 * (fy - fz)};
}

// HyAB (section 4.1.2): city-block in lightness, Euclidean in chroma.
float hyab(const glm::vec3& a, const glm::vec3& b) {
  return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

using Plane = std::vector<float>;
struct Size {
  int width, height;
};

// Both kernels have an odd length; beyond the picture its border goes on.
Plane convolve(const Plane& in, Size size, const std::vector<float>& alongX, const std::vector<float>& alongY) {
  const int rx = int(alongX.size()) / 2, ry = int(alongY.size()) / 2, w = size.width, h = size.height;
  Plane rows(in.size(), 0.f), out(in.size(), 0.f), padded(std::size_t(w) + 2 * rx);
  for (int y = 0; y < h; ++y) {
    const float* row = &in[std::size_t(y) * w];
    for (int x = 0; x < int(padded.size()); ++x) padded[x] = row[std::clamp(x - rx, 0, w - 1)];
    float* to = &rows[std::size_t(y) * w];
    for (int k = 0; k < int(alongX.size()); ++k)
      for (int x = 0; x < w; ++x) to[x] += alongX[k] * padded[x + k];
  }
  for (int y = 0; y < h; ++y) {
    float* to = &out[std::size_t(y) * w];
    for (int k = 0; k < int(alongY.size()); ++k) {
      const float* from = &rows[std::size_t(std::clamp(y + k - ry, 0, h - 1)) * w];
      for (int x = 0; x < w; ++x) to[x] += alongY[k] * from[x];
    }
  }
  return out;
}

void scale(std::vector<float>& kernel, float factor) {
  for (float& k : kernel) k *= factor;
}
float sum(const std::vector<float>& kernel) {
  return std::accumulate(kernel.begin(), kernel.end(), 0.f);
}

// The picture as the eye resolves it: a channel blurred by its contrast sensitivity. In two dimensions a Gaussian is
// the product of its own along x and y, so that each term is two short passes; all terms together sum to one.
Plane blurred(const Plane& channel, Size size, const Gaussian* terms, int count, float pixelsPerDegree) {
  const int radius = int(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * pixelsPerDegree));
  Plane out(channel.size(), 0.f);
  float total = 0;
  for (int t = 0; t < count; ++t) {
    std::vector<float> kernel(2 * radius + 1);
    for (int k = -radius; k <= radius; ++k) {
      const float x = float(k) / pixelsPerDegree;
      kernel[k + radius] = std::exp(-kPi * kPi * x * x / terms[t].b);
    }
    const float one = sum(kernel), weight = terms[t].a * std::sqrt(kPi / terms[t].b);
    total += weight * one * one;
    const Plane term = convolve(channel, size, kernel, kernel);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += weight * term[i];
  }
  scale(out, 1 / total);
  return out;
}

struct Features {
  Plane edge, point;  // lengths of the gradients
};

// Section 4.2: first and second derivatives of Gaussians on luminance in 0..1, each with its positive and its negative
// weights summing to one.
Features detect(const Plane& luminance, Size size, float pixelsPerDegree) {
  const float deviation = 0.5f * kFeatureWidth * pixelsPerDegree;
  const int radius = int(std::ceil(3 * deviation));
  std::vector<float> smooth, first, second;
  for (int k = -radius; k <= radius; ++k) {
    const float x = float(k), g = std::exp(-x * x / (2 * deviation * deviation));
    smooth.push_back(g);
    first.push_back(-x * g);
    second.push_back((x * x / (deviation * deviation) - 1) * g);
  }
  scale(smooth, 1 / sum(smooth));
  for (std::vector<float>* kernel : {&first, &second}) {
    float positive = 0, negative = 0;
    for (const float k : *kernel) (k > 0 ? positive : negative) += std::abs(k);
    for (float& k : *kernel) k /= k > 0 ? positive : negative;
  }
  const auto length = [&](const std::vector<float>& derivative) {
    const Plane x = convolve(luminance, size, derivative, smooth), y = convolve(luminance, size, smooth, derivative);
    Plane out(x.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
    return out;
  };
  return {length(first), length(second)};
}

struct Seen {
  std::vector<glm::vec3> lab;  // with the Hunt effect, of the blurred picture
  Features features;
};

Seen see(const Image& image, float pixelsPerDegree) {
  const Size size{image.width, image.height};
  const std::size_t count = image.pixels.size() / 4;
  std::array<float, 256> linear;
  for (int v = 0; v < 256; ++v) linear[v] = float(lightFromSrgb(v / 255.0));
  Plane channel[3];
  for (Plane& c : channel) c.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* p = &image.pixels[4 * i];
    const glm::vec3 o = opponentFromRgb({linear[p[0]], linear[p[1]], linear[p[2]]});
    for (int c = 0; c < 3; ++c) channel[c][i] = o[c];
  }
  Seen seen;
  Plane luminance(count);
  for (std::size_t i = 0; i < count; ++i) luminance[i] = (channel[0][i] + 16) / 116;
  seen.features = detect(luminance, size, pixelsPerDegree);
  channel[0] = blurred(channel[0], size, &kAchromatic, 1, pixelsPerDegree);
  channel[1] = blurred(channel[1], size, &kRedGreen, 1, pixelsPerDegree);
  channel[2] = blurred(channel[2], size, kBlueYellow, 2, pixelsPerDegree);
  seen.lab.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    seen.lab[i] = huntLabFromRgb(rgbFromOpponent({channel[0][i], channel[1][i], channel[2][i]}));
  return seen;
}

// Section 4.1.3: large differences are all alike, so that they share the top twentieth of the range.
float bend(float difference, float largest) {
  const float at = kBendAt * largest;
  if (difference < at) return kBendTo / at * difference;
  return std::min(kBendTo + (difference - at) / (largest - at) * (1 - kBendTo), 1.f);
}

}  // namespace

std::vector<float> flipErrors(const Image& a, const Image& b, float pixelsPerDegree) {
  assert(a.width == b.width && a.height == b.height && a.pixels.size() == b.pixels.size());
  const float largest =
      std::pow(hyab(huntLabFromRgb({0, 1, 0}), huntLabFromRgb({0, 0, 1})), kColourExponent);  // between primaries
  const Seen seenA = see(a, pixelsPerDegree), seenB = see(b, pixelsPerDegree);
  std::vector<float> out(seenA.lab.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float colour = bend(std::pow(hyab(seenA.lab[i], seenB.lab[i]), kColourExponent), largest);
    const float edge = std::abs(seenA.features.edge[i] - seenB.features.edge[i]),
                point = std::abs(seenA.features.point[i] - seenB.features.point[i]);
    const float feature = std::pow(std::max(edge, point) / std::numbers::sqrt2_v<float>, kFeatureExponent);
    out[i] =
        std::pow(colour, 1 - std::min(feature, 1.f));  // section 4.3; 0^0 cannot be: equal colours have equal edges
  }
  return out;
}

double flipMean(const Image& a, const Image& b, float pixelsPerDegree) {
  double total = 0;
  const std::vector<float> errors = flipErrors(a, b, pixelsPerDegree);
  for (const float e : errors) total += e;
  return errors.empty() ? 0 : total / double(errors.size());
}

}  // namespace medulla
