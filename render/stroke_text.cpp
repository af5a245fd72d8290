#include "render/stroke_text.h"

#include <algorithm>
#include <cmath>

namespace medulla {

using glm::vec2;

Ink::Ink(Image& image, vec2 low, vec2 high)
    : image_(image),
      low_(glm::max(glm::ivec2(low), 0)),
      size_(glm::max(glm::min(glm::ivec2(glm::ceil(high)), {image.width, image.height}) - low_, 0)),
      cover_(std::size_t(size_.x) * size_.y, 0.f) {}

template <class Share>
void Ink::cover(vec2 low, vec2 high, const Share& shareAt) {
  const glm::ivec2 from = glm::max(glm::ivec2(low) - low_, 0), end = glm::min(glm::ivec2(high) - low_, size_);
  for (int y = from.y; y < end.y; ++y)
    for (int x = from.x; x < end.x; ++x) {
      const float share = shareAt(low_.x + x, low_.y + y);
      if (share <= 0) continue;
      const std::size_t i = std::size_t(y) * size_.x + x;
      if (cover_[i] == 0) touched_.push_back(i);
      cover_[i] = std::max(cover_[i], share);
    }
}

void Ink::stroke(vec2 a, vec2 b, float radius) {
  const vec2 along = b - a;
  const float length2 = glm::dot(along, along);
  cover(glm::min(a, b) - radius - 1.f, glm::max(a, b) + radius + 2.f, [&](int x, int y) {
    const vec2 p = vec2(float(x) + 0.5f, float(y) + 0.5f) - a;
    const float u = length2 > 0 ? glm::clamp(glm::dot(p, along) / length2, 0.f, 1.f) : 0.f;
    return glm::clamp(radius + 0.5f - glm::length(p - u * along), 0.f, 1.f);
  });
}

void Ink::fill(vec2 low, vec2 high) {
  cover(low, high, [](int, int) { return 1.f; });
}

void Ink::apply(glm::vec3 colour, float opacity) {
  glm::vec3 shown;
  for (int c = 0; c < 3; ++c) shown[c] = 255 * float(srgbFromLight(colour[c]));
  for (const std::size_t i : touched_) {
    const float share = opacity * cover_[i];
    const std::size_t x = low_.x + i % size_.x, y = low_.y + i / size_.x;
    std::uint8_t* pixel = &image_.pixels[4 * (y * image_.width + x)];
    for (int c = 0; c < 3; ++c)
      pixel[c] = std::uint8_t(std::lround(float(pixel[c]) + share * (shown[c] - float(pixel[c]))));
    cover_[i] = 0;
  }
  touched_.clear();
}

namespace {

// Strokes between points of a grid, x 0..4 to the right and y 0..8 downwards: capitals from 0 to 6, small letters from
// 2 to 6, tails to 8. A blank lifts the pen.
struct Glyph {
  char character;
  float advance;
  const char* strokes;
};
constexpr Glyph kGlyphs[] = {
    {' ', 3, ""},
    {'!', 3, "0004 0606"},
    {'"', 4, "0001 2021"},
    {'#', 6, "1016 3036 0242 0444"},
    {'$', 6, "413010010213334445361605 2026"},
    {'%', 6, "0640 0010110100 3545463635"},
    {'&', 6, "4612112031320405162644"},
    {'\'', 2, "0001"},
    {'(', 3, "10010516"},
    {')', 3, "00111506"},
    {'*', 6, "2024 0143 0341"},
    {'+', 6, "0343 2125"},
    {',', 3, "0607"},
    {'-', 6, "1333"},
    {'.', 3, "0606"},
    {'/', 5, "0630"},
    {'0', 6, "103041453616050110"},
    {'1', 5, "112026"},
    {'2', 6, "01103041420646"},
    {'3', 6, "004022324345361605"},
    {'4', 6, "36300444"},
    {'5', 6, "400002324345361605"},
    {'6', 6, "30110305163645443303"},
    {'7', 6, "004016"},
    {'8', 6, "103041423313020110 1304051636454433"},
    {'9', 6, "16354341301001021343"},
    {':', 3, "0303 0606"},
    {';', 3, "0303 0607"},
    {'<', 6, "410345"},
    {'=', 6, "0242 0444"},
    {'>', 6, "014305"},
    {'?', 6, "01103041422324 2626"},
    {'@', 6, "461605011030414434322213142434"},
    {'A', 6, "062046 1434"},
    {'B', 6, "06003041423303 3344453606"},
    {'C', 6, "4130100105163645"},
    {'D', 6, "06002042442606"},
    {'E', 6, "40000646 0333"},
    {'F', 6, "400006 0333"},
    {'G', 6, "41301001051636454323"},
    {'H', 6, "0006 4046 0343"},
    {'I', 4, "1016"},
    {'J', 6, "4045361605"},
    {'K', 6, "0006 400346"},
    {'L', 6, "000646"},
    {'M', 6, "0600234046"},
    {'N', 6, "06004640"},
    {'O', 6, "20414526050120"},
    {'P', 6, "06003041423303"},
    {'Q', 6, "20414526050120 2446"},
    {'R', 6, "06003041423303 2346"},
    {'S', 6, "413010010213334445361605"},
    {'T', 6, "0040 2026"},
    {'U', 6, "000516364540"},
    {'V', 6, "002640"},
    {'W', 6, "0016223640"},
    {'X', 6, "0046 4006"},
    {'Y', 6, "002340 2326"},
    {'Z', 6, "00400646"},
    {'[', 3, "10000616"},
    {'\\', 5, "0036"},
    {']', 3, "00101606"},
    {'^', 6, "022042"},
    {'_', 6, "0747"},
    {'`', 3, "0011"},
    {'a', 5, "3322120305162635 3236"},
    {'b', 5, "0006 0312223335261605"},
    {'c', 5, "3322120305162635"},
    {'d', 5, "3036 3322120305162635"},
    {'e', 5, "04343322120305162635"},
    {'f', 4, "30201116 0222"},
    {'g', 5, "3322120305162635 3237281807"},
    {'h', 5, "0006 0312223336"},
    {'i', 2, "0206 0000"},
    {'j', 3, "121708 1010"},
    {'k', 5, "0006 320436"},
    {'l', 2, "0006"},
    {'m', 6, "0206 03122326 23324346"},
    {'n', 5, "0206 0312223336"},
    {'o', 5, "122233352616050312"},
    {'p', 5, "0208 0312223335261605"},
    {'q', 5, "3238 3322120305162635"},
    {'r', 4, "0206 031222"},
    {'s', 5, "3212031424352606"},
    {'t', 4, "101526 0222"},
    {'u', 5, "0205162635 3236"},
    {'v', 6, "022642"},
    {'w', 6, "0216243642"},
    {'x', 5, "0236 3206"},
    {'y', 6, "0226 4218"},
    {'z', 5, "02320636"},
    {'{', 4, "20111203141526"},
    {'|', 2, "0007"},
    {'}', 4, "00111223141506"},
    {'~', 6, "04133443"},
};
constexpr Glyph kBox{'\0', 6, "0040460600"};

const Glyph& glyphOf(char character) {
  const auto* found = std::lower_bound(std::begin(kGlyphs), std::end(kGlyphs), character,
                                       [](const Glyph& g, char c) { return g.character < c; });
  return found != std::end(kGlyphs) && found->character == character ? *found : kBox;
}

// Turns of up to 66 degrees are of arcs: a quarter circle on the grid is two of 45. Bezier curves take their place.
void appendCorner(vec2 before, vec2 corner, vec2 after, float unit, std::vector<vec2>& path) {
  constexpr int kPieces = 6;
  constexpr float kLongest = 0.75f;  // grid units of a stroke that the curve may take; half of it where it is short
  const vec2 in = corner - before, out = after - corner;
  const float inLength = glm::length(in), outLength = glm::length(out);
  if (glm::dot(in, out) < 0.4f * inLength * outLength) {
    path.push_back(corner);
    return;
  }
  const vec2 from = corner - std::min(0.5f, kLongest * unit / inLength) * in,
             to = corner + std::min(0.5f, kLongest * unit / outLength) * out;
  for (int k = 0; k <= kPieces; ++k) {
    const float t = float(k) / kPieces;
    path.push_back(glm::mix(glm::mix(from, corner, t), glm::mix(corner, to, t), t));
  }
}

// A polyline of the grid, at least two points, with its arcs made round.
void strokeLine(const std::vector<vec2>& points, float unit, float radius, Ink& ink) {
  std::vector<vec2> path;
  const std::size_t last = points.size() - 1;
  const bool isClosed = last > 1 && points[0] == points[last];
  if (!isClosed) path.push_back(points[0]);
  for (std::size_t k = 1; k < last; ++k) appendCorner(points[k - 1], points[k], points[k + 1], unit, path);
  if (isClosed) {
    appendCorner(points[last - 1], points[0], points[1], unit, path);
    path.push_back(path[0]);
  } else {
    path.push_back(points[last]);
  }
  for (std::size_t k = 1; k < path.size(); ++k) ink.stroke(path[k - 1], path[k], radius);
}

// Of UTF-8: the bytes that carry a character on have no place of their own.
bool continues(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) == 0x80;
}

}  // namespace

float textWidth(const std::string& text, float height) {
  float width = 0;
  for (const char c : text)
    if (!continues(c)) width += glyphOf(c).advance;
  return width * height / 6;
}

void writeText(const std::string& text, vec2 corner, float height, Ink& ink) {
  const float unit = height / 6;
  for (const char c : text) {
    if (continues(c)) continue;
    const Glyph& glyph = glyphOf(c);
    for (const char* at = glyph.strokes; *at;) {
      std::vector<vec2> points;
      for (; *at && *at != ' '; at += 2) points.push_back(corner + unit * vec2(float(at[0] - '0'), float(at[1] - '0')));
      strokeLine(points, unit, 0.085f * height, ink);
      if (*at) ++at;
    }
    corner.x += glyph.advance * unit;
  }
}

}  // namespace medulla
