#include "render/detail_texture.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "render/noise.h"

namespace medulla {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Arithmetic of IEEE 754 alone: where mathematical libraries differ in a last digit, a vessel would meet another or
// not, and the whole tree behind it differ.
float sineOf(float angle) {  // within 0.001; two parabolas, corrected once
  const float turns = angle * 0.15915494f, t = turns - std::floor(turns + 0.5f);
  const float s = 8 * t - 16 * t * std::abs(t);
  return s + 0.225f * (s * std::abs(s) - s);
}
glm::vec2 directionOf(float angle) {
  return {sineOf(angle + kPi / 2), sineOf(angle)};
}
float cubeRoot(float x) {  // of 0.3 to 1, by Newton's method
  float y = 1;
  for (int k = 0; k < 6; ++k) y -= (y * y * y - x) / (3 * y * y);
  return y;
}

// A small generator of its own (xorshift, Marsaglia 2003): the standard library's distributions differ between
// versions.
class RandomFloats {
 public:
  explicit RandomFloats(std::uint32_t seed) : state_(seed * 2654435761u + 1) {}
  float next() {  // 0..1
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return float(state_ >> 8) * (1.f / 16777216.f);
  }

 private:
  std::uint32_t state_;
};

// Vessel trees grown on the torus of texels, the widest tip first, so that trunks have their room before twigs fill
// what is left. A vessel keeps its heading, winds about it, thins at each fork after Murray (1926), r0^3 = r1^3 + r2^3,
// and turns away from, or ends before, any other: vessels of one layer do not cross.
class VesselPainter {
 public:
  VesselPainter(const DetailPattern& pattern, int seed)
      : side_(pattern.side),
        unit_(float(pattern.side) / 512),
        random_(seed),
        opacity_(std::size_t(side_) * side_, 0.f),
        owner_(opacity_.size(), 0) {
    for (int k = 0; k < pattern.vesselTrees; ++k) {
      // The R2 sequence (Roberts 2018) is even on the torus for any count: bare and crowded corners would betray the
      // tile.
      const float x = std::fmod(0.5f + float(k) * 0.75487767f, 1.f), y = std::fmod(0.5f + float(k) * 0.56984029f, 1.f);
      Tip t;
      t.x = (x + 0.06f * random_.next()) * float(side_);
      t.y = (y + 0.06f * random_.next()) * float(side_);
      const float aside = (random_.next() - 0.5f) * 1.1f;
      const float turned = random_.next() < 0.35f ? kPi : 0.f;
      t.heading = pattern.vesselHeading + aside + turned;
      t.width = pattern.vesselWidth * (0.6f + 0.4f * random_.next()) * unit_;
      t.trunk = true;
      t.phase = 2 * kPi * random_.next();
      push(t);
    }
    while (!tips_.empty()) {
      std::pop_heap(tips_.begin(), tips_.end(), thinner);
      const Tip t = tips_.back();
      tips_.pop_back();
      grow(t);
    }
  }
  const std::vector<float>& opacity() const { return opacity_; }

 private:
  static constexpr float kBend = 0.4f;  // rad, how far vessels wind about their heading
  struct Tip {
    float x = 0, y = 0, heading = 0, width = 0;  // texels, rad
    float phase = 0;                             // of the winding
    float clear = 0;                             // texels until it must keep away from others: it leaves its parent
    float age = 0;                               // texels
    bool trunk = false;
    std::uint16_t id = 0;
  };
  static bool thinner(const Tip& a, const Tip& b) { return a.width != b.width ? a.width < b.width : a.id > b.id; }

  void push(Tip t) {
    t.id = ++count_;
    tips_.push_back(t);
    std::push_heap(tips_.begin(), tips_.end(), thinner);
  }

  std::size_t texelAt(float x, float y) const {
    const int px = int(std::floor(x)) % side_, py = int(std::floor(y)) % side_;
    return std::size_t(py < 0 ? py + side_ : py) * side_ + (px < 0 ? px + side_ : px);
  }
  bool taken(const Tip& t, float angle, float ahead) const {
    const glm::vec2 d = ahead * directionOf(angle);
    const std::uint16_t owner = owner_[texelAt(t.x + d.x, t.y + d.y)];
    return owner != 0 && owner != t.id;
  }

  // From fork to fork, or to the end.
  void grow(Tip t) {
    const float thick = t.width / unit_;
    const int length = int((22 + 34 * random_.next()) * unit_ * (0.45f + 0.5f * thick));
    // Thin vessels wind more, and in shorter waves.
    const float amplitude = kBend * 1.25f / (0.7f + 0.4f * thick), wave = (26 + 16 * thick) * unit_;
    float drift = 0;
    for (int s = 0; s < length; ++s) {
      drift += -0.05f * drift + (random_.next() - 0.5f) * 0.09f;
      const float angle = t.heading + drift + amplitude * sineOf(t.phase + 2 * kPi * t.age / wave);
      if (t.clear <= 0 && !steer(t, angle)) t.width *= 0.93f;
      const glm::vec2 step = directionOf(angle);
      t.x += step.x;
      t.y += step.y;
      t.age += 1;
      t.clear -= 1;
      // A trunk fades in as if it surfaced from the depth.
      splat(t, t.trunk ? std::min(1.f, t.age / (60 * unit_)) : 1.f);
      t.width *= 0.9992f;
      if (t.width < kThinnest * unit_) return;
    }
    fork(t);
  }

  // False where there is no room ahead.
  bool steer(Tip& t, float angle) {
    const float near = t.width + 3 * unit_, far = 2.2f * near;
    const bool left = taken(t, angle + 0.5f, far), right = taken(t, angle - 0.5f, far);
    if (left != right) t.heading += left ? -0.035f / unit_ : 0.035f / unit_;
    return !taken(t, angle, near);
  }

  // A twig that leaves at a wide angle, or two branches of like width at a narrow one.
  void fork(Tip t) {
    const bool twig = random_.next() < (t.trunk ? 0.75f : 0.35f);
    const float share = (twig ? 0.42f : 0.66f) + 0.2f * random_.next();
    const float turn = random_.next() < 0.5f ? -1.f : 1.f, apart = 1.25f - 0.75f * share;
    Tip branch = t;
    branch.width = t.width * share;
    branch.heading += turn * (apart + 0.25f * random_.next());
    branch.trunk = false;
    branch.clear = 2.2f * t.width + 2.5f * kClearance * unit_;
    t.heading -= turn * 0.55f * share * share;
    t.width *= cubeRoot(1 - share * share * share);
    t.clear = branch.clear;
    if (branch.width > kThinnest * unit_) {
      branch.phase = 2 * kPi * random_.next();
      push(branch);
    }
    if (t.width > kThinnest * unit_) push(t);
  }

  void splat(const Tip& t, float fade) {
    const float strength = std::clamp(0.34f + t.width / unit_ * 0.30f, 0.f, 0.95f) * fade;
    const float guard = t.width + kClearance * unit_;
    const int reach = int(std::ceil(guard + 0.5f));
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const std::size_t at = texelAt(t.x + float(i), t.y + float(j));
        const float dx = std::floor(t.x + float(i)) + 0.5f - t.x, dy = std::floor(t.y + float(j)) + 0.5f - t.y;
        const float distance = std::sqrt(dx * dx + dy * dy);
        if (distance > guard) continue;
        if (owner_[at] == 0) owner_[at] = t.id;
        opacity_[at] = std::max(opacity_[at], std::clamp(t.width + 0.5f - distance, 0.f, 1.f) * strength);
      }
  }

  static constexpr float kThinnest = 0.3f, kClearance = 3.5f;  // texels of a 512 tile
  int side_;
  float unit_;  // texels per texel of a 512 tile
  RandomFloats random_;
  std::vector<float> opacity_;
  std::vector<std::uint16_t> owner_;  // 0: free
  std::vector<Tip> tips_;             // heap
  std::uint16_t count_ = 0;
};

// Adds amplitude * tiledNoise(columns * x / side + shift, period * y / side, period, seed) to every texel, with so many
// times fewer columns than rows as it is `longer` along x than across. Row by row: the lattice is blended along y once
// per lattice column instead of once per texel.
void addNoise(int period, int longer, float shift, int seed, float amplitude, std::vector<float>& image, int side) {
  const int columns = std::max(1, period / longer);
  std::vector<int> cell(side);
  std::vector<float> share(side), column(columns + 1);
  const float scale = float(period) / float(side), scaleX = float(columns) / float(side);
  for (int x = 0; x < side; ++x) {
    const float u = float(x) * scaleX + shift, floor = std::floor(u), t = u - floor;
    cell[x] = int(floor) % columns;
    share[x] = t * t * (3 - 2 * t);
  }
  for (int y = 0; y < side; ++y) {
    for (int k = 0; k < columns; ++k) column[k] = amplitude * tiledNoise(float(k), float(y) * scale, period, seed);
    column[columns] = column[0];
    float* row = &image[std::size_t(y) * side];
    for (int x = 0; x < side; ++x) {
      const float a = column[cell[x]];
      row[x] += a + (column[cell[x] + 1] - a) * share[x];
    }
  }
}

// Lobules: distance to the border between cells whose grid is warped, so that no cell looks like its neighbour.
std::vector<float> lobules(const DetailPattern& pattern) {
  const int n = pattern.side, cells = pattern.cells;
  std::vector<float> out(std::size_t(n) * n, 0.f), warpU = out, warpV = out;
  if (cells == 0) return out;
  addNoise(14, 1, 0, 61, 0.9f, warpU, n);
  addNoise(14, 1, 0, 62, 0.9f, warpV, n);
  const float scale = float(cells) / float(n);
  for (int y = 0, i = 0; y < n; ++y)
    for (int x = 0; x < n; ++x, ++i)
      out[i] = smoothStep(0, 0.5f, tiledCells(float(x) * scale + warpU[i], float(y) * scale + warpV[i], cells, 77));
  return out;
}

// A board's growth rings are a section through nested shells: bands of even noise, each dark towards its end, with
// fibres between.
std::vector<float> woodGrain(const DetailPattern& pattern, int seed) {
  constexpr float kRings = 7, kFibres = 0.55f;
  const int n = pattern.side;
  std::vector<float> shells(std::size_t(n) * n, 0.f), fibres = shells;
  for (int octave = 0; octave < 3; ++octave)
    addNoise(4 << octave, std::max(1, pattern.grain / 4), 0, octave + 31 * seed, 0.6f / float(1 << octave), shells, n);
  for (int octave = 0; octave < 2; ++octave)
    addNoise(128 << octave, pattern.grain, 0, 7 + octave + 31 * seed, 0.5f, fibres, n);
  for (std::size_t i = 0; i < shells.size(); ++i) {
    const float ring = kRings * shells[i], along = ring - std::floor(ring);
    shells[i] = (1 - kFibres) * (1 - along * along) * smoothStep(0, 0.12f, along) + kFibres * fibres[i];
  }
  return shells;
}

std::uint8_t toByte(float v) {
  return std::uint8_t(std::clamp(v * 255 + 0.5f, 0.f, 255.f));
}

}  // namespace

std::vector<std::uint8_t> makeDetailTexture(const DetailPattern& pattern, int seed) {
  const int n = pattern.side;
  const VesselPainter vessels(pattern, seed + 3);
  const std::vector<float> lobule = lobules(pattern);
  std::vector<float> mottling(lobule.size(), 0.f), height = mottling;
  for (int octave = 0; octave < 6 && pattern.grain == 0; ++octave)
    addNoise(4 << octave, 1, 0, octave + 31 * seed, 0.5f / float(1 << octave), mottling, n);
  if (pattern.grain > 0) mottling = woodGrain(pattern, seed);
  for (int octave = 0; octave < 4; ++octave)
    addNoise(20 << octave, 1, 0.3f, 17 + octave + 31 * seed, 0.5f / float(1 << octave), height, n);
  // Vessels stand out a little, but not among lobules: there they read as scratches.
  const float vesselHeight = pattern.cellContrast > 0 ? 0.f : 0.05f;
  for (std::size_t i = 0; i < height.size(); ++i) {
    mottling[i] = glm::mix(mottling[i], lobule[i], pattern.cellContrast);
    height[i] += pattern.cellRelief * lobule[i] + vesselHeight * vessels.opacity()[i];
  }
  assert((n & (n - 1)) == 0);
  const auto at = [&](int x, int y) { return height[(y & (n - 1)) * n + (x & (n - 1))]; };
  const float slope = 6 * float(n) / 512;
  std::vector<std::uint8_t> out(4ul * n * n);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      std::uint8_t* texel = &out[4ul * (y * n + x)];
      texel[0] = toByte(mottling[y * n + x]);
      texel[1] = toByte(vessels.opacity()[y * n + x]);
      texel[2] = toByte((at(x + 1, y) - at(x - 1, y)) * slope * 0.5f + 0.5f);
      texel[3] = toByte((at(x, y + 1) - at(x, y - 1)) * slope * 0.5f + 0.5f);
    }
  return out;
}

}  // namespace medulla
