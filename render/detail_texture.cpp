#include "render/detail_texture.h"

#include <algorithm>
#include <cmath>

#include "render/noise.h"

namespace medulla {
namespace {

constexpr int kMaxForks = 6;

// Vessel trees grown by walkers on the torus of texels. A vessel keeps its heading (a wobble that returns to the mean:
// plain random walks curl), and thins at each fork after Murray (1926): r0^3 = r1^3 + r2^3.
class VesselPainter {
 public:
  VesselPainter(const DetailPattern& pattern, int seed)
      : side_(pattern.side), unit_(float(pattern.side) / 512), random_(seed), opacity_(side_ * side_, 0.f) {
    for (int k = 0; k < pattern.vesselTrees; ++k) {
      const float turn = random_.next() < 0.3f ? 3.1416f : 0.f;
      const float heading = pattern.vesselHeading + (random_.next() - 0.5f) * 1.5f + turn;
      const int row = k / 3;
      // One tree per cell of a coarse grid: bare and crowded corners would betray the tile.
      const float x = (float(k % 3) + 0.2f + 0.6f * random_.next()) * float(side_) / 3;
      const float y = (float(row) + 0.2f + 0.6f * random_.next()) * float(side_) / 3;
      grow({x, y, heading, heading, pattern.vesselWidth * (0.55f + 0.45f * random_.next()) * unit_, 0});
    }
  }
  const std::vector<float>& opacity() const { return opacity_; }

 private:
  struct Walker {
    float x, y, angle, heading, width;
    int forks;
  };

  void grow(Walker w) {
    float wobble = 0, untilFork = (26 + 30 * random_.next()) * unit_ * (0.6f + 0.4f * w.width / unit_);
    float turn = random_.next() < 0.5f ? -1.f : 1.f;
    const float steps = (150 + 90 * random_.next()) * unit_ * std::min(1.f, 0.25f + w.width / (2.2f * unit_));
    for (int step = 0; step < int(std::ceil(steps)); ++step) {
      wobble += -0.06f * wobble + (random_.next() - 0.5f) * 0.11f;
      w.angle += (w.heading - w.angle) * 0.012f;
      const float angle = w.angle + wobble;
      w.x += std::cos(angle);
      w.y += std::sin(angle);
      // A trunk fades in as if it surfaced from the depth.
      splat(w, w.forks ? 1.f : std::min(1.f, float(step) / (70 * unit_)));
      w.width *= 0.9990f;
      untilFork -= 1;
      if (untilFork < 0 && w.forks < kMaxForks - 1) {
        turn = -turn;
        sideBranch(w, angle, turn);
        untilFork = (18 + 34 * random_.next()) * unit_ * (0.5f + 0.5f * w.width / unit_);
      }
      if (w.width < 0.32f * unit_) return;
    }
    if (w.forks >= kMaxForks || w.width < 0.5f * unit_) return;
    grow({w.x, w.y, w.angle + 0.38f, w.heading + 0.30f, w.width * 0.78f, w.forks + 1});
    grow({w.x, w.y, w.angle - 0.42f, w.heading - 0.30f, w.width * 0.70f, w.forks + 1});
  }

  void sideBranch(Walker& w, float angle, float turn) {
    const float ratio = 0.50f + 0.26f * random_.next();
    if (w.width * ratio < 0.34f * unit_) return;
    const float a = angle + turn * (0.55f + 0.35f * random_.next());
    const float h = w.heading + turn * (0.25f + 0.25f * random_.next());
    grow({w.x, w.y, a, h, w.width * ratio, w.forks + 1});
    w.angle -= turn * 0.12f * ratio;
    w.width *= std::cbrt(1 - 0.8f * ratio * ratio * ratio);
  }

  void splat(const Walker& w, float fade) {
    const float strength = std::clamp(0.30f + w.width / unit_ * 0.30f, 0.f, 0.95f) * fade;
    const int reach = int(std::ceil(w.width + 1.5f));
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const int px = int(std::floor(w.x)) + i, py = int(std::floor(w.y)) + j;
        const float dx = float(px) - w.x, dy = float(py) - w.y;
        const float cover = std::clamp(w.width + 0.5f - std::sqrt(dx * dx + dy * dy), 0.f, 1.f) * strength;
        float& texel = opacity_[((py % side_ + side_) % side_) * side_ + (px % side_ + side_) % side_];
        texel = std::max(texel, cover);
      }
  }

  int side_;
  float unit_;  // texels per texel of a 512 tile
  RandomSequence random_;
  std::vector<float> opacity_;
};

// Lobules: distance to the border between cells whose grid is warped, so that no cell looks like its neighbour.
float lobule(float u, float v, int cells) {
  const float warpU = 0.9f / float(cells) * tiledNoise(u * 14, v * 14, 14, 61),
              warpV = 0.9f / float(cells) * tiledNoise(u * 14, v * 14, 14, 62);
  return smoothStep(0, 0.5f, tiledCells((u + warpU) * float(cells), (v + warpV) * float(cells), cells, 77));
}

float mottling(float u, float v, int seed, const DetailPattern& pattern) {
  float sum = 0, amplitude = 0.5f;
  for (int octave = 0, period = 4; octave < 6; ++octave, period *= 2, amplitude *= 0.5f)
    sum += amplitude * tiledNoise(u * float(period), v * float(period), period, octave + 31 * seed);
  if (pattern.cells == 0) return sum;
  return glm::mix(sum, lobule(u, v, pattern.cells), pattern.cellContrast);
}

float relief(float u, float v, int seed, const DetailPattern& pattern) {
  float sum = 0, amplitude = 0.5f;
  for (int octave = 0, period = 20; octave < 4; ++octave, period *= 2, amplitude *= 0.5f)
    sum += amplitude * tiledNoise(u * float(period) + 0.3f, v * float(period), period, 17 + octave + 31 * seed);
  return pattern.cellRelief > 0 ? sum + pattern.cellRelief * lobule(u, v, pattern.cells) : sum;
}

std::uint8_t toByte(float v) {
  return std::uint8_t(std::clamp(v * 255 + 0.5f, 0.f, 255.f));
}

}  // namespace

std::vector<std::uint8_t> makeDetailTexture(const DetailPattern& pattern, int seed) {
  const int n = pattern.side;
  const VesselPainter vessels(pattern, seed + 3);
  std::vector<float> height(n * n);
  // Vessels stand out a little, but not among lobules: there they read as scratches.
  const float vesselHeight = pattern.cellContrast > 0 ? 0.f : 0.05f;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x)
      height[y * n + x] =
          relief(float(x) / float(n), float(y) / float(n), seed, pattern) + vesselHeight * vessels.opacity()[y * n + x];
  const auto at = [&](int x, int y) { return height[((y + n) % n) * n + (x + n) % n]; };
  const float slope = 6 * float(n) / 512;
  std::vector<std::uint8_t> out(4ul * n * n);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      std::uint8_t* texel = &out[4ul * (y * n + x)];
      texel[0] = toByte(mottling(float(x) / float(n), float(y) / float(n), seed, pattern));
      texel[1] = toByte(vessels.opacity()[y * n + x]);
      texel[2] = toByte((at(x + 1, y) - at(x - 1, y)) * slope * 0.5f + 0.5f);
      texel[3] = toByte((at(x, y + 1) - at(x, y - 1)) * slope * 0.5f + 0.5f);
    }
  return out;
}

}  // namespace medulla
