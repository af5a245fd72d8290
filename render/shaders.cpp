#include "render/shaders.h"

#include <stdexcept>

#include "render/gl_functions.h"

namespace medulla {
namespace {

// The ACES curve (Narkowicz 2015) and the sRGB transfer in one rational fit over sqrt(x), largest error 0.006 up to 20
// times white, 0.012 beyond: a quarter of the time of both in turn. For slow gradients half a grey level of interleaved
// gradient noise (Jimenez 2014) either way.
constexpr const char* kToPixels = R"(
vec3 toneCurve(vec3 c) {
  vec3 r = sqrt(max(c, 0.));
  return (5.21175593 * c + .0267191537 * r - .00373619759) / (5.32664275 * c - .583381459 * r + 1.);
}
float tremble() {
  return (fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715)))) - .5) / 255.;
}
)";

unsigned compile(unsigned kind, const std::string& source) {
  const unsigned shader = glCreateShader(kind);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  int ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok) return shader;
  char log[2048] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  throw std::runtime_error(std::string("a shader does not compile: ") + log);
}

}  // namespace

void readAttribute(unsigned location, int floats, std::size_t stride, std::size_t offset) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, floats, GL_FLOAT, GL_FALSE, int(stride), bufferOffset(offset));
}

unsigned buildProgram(const std::string& defines, const char* vertex, const char* fragment) {
  const std::string head =
      "#version 330 core\n#extension GL_ARB_texture_gather : require\n#define BLEED .018\n" + defines;
  const unsigned program = glCreateProgram();
  const unsigned shaders[] = {compile(GL_VERTEX_SHADER, head + vertex),
                              compile(GL_FRAGMENT_SHADER, head + kToPixels + fragment)};
  for (const unsigned s : shaders) glAttachShader(program, s);
  glLinkProgram(program);
  for (const unsigned s : shaders) glDeleteShader(s);
  int ok = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (ok) return program;
  char log[2048] = "";
  glGetProgramInfoLog(program, sizeof log, nullptr, log);
  throw std::runtime_error(std::string("shaders do not link: ") + log);
}

// surface: mottling, vessel opacity, slope of the film's relief, how far red light bleeds into shadow. lobes: a1 - 1,
// c1, a2 - 1, c2 of GlossLobes. Interpolated without perspective: the triangles are small, and
// a division per pixel is saved. What a draw shares comes to the pixels as flat inputs: llvmpipe gathers uniforms lane
// by lane, for a tenth of a pixel's time. Eight outputs with the position: with ten, Mesa 22.3 with vectors of 128 bits
// writes past a buffer of its own.
const char* const kTissueVertexShader = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 directGloss;
layout(location = 2) in vec4 ambientRadius;
layout(location = 3) in vec4 halfwayBias;
layout(location = 4) in vec4 uvDetailSeam;
uniform mat4 clipFromWorld, shadowFromWorld;
uniform vec4 surface, lobes;
uniform vec3 tint;
noperspective out vec4 vDirect;
noperspective out vec4 vAmbient;
noperspective out vec4 vHalfway;
noperspective out vec4 vUv;
flat out vec4 fTint;
flat out vec4 fLobes;
#if SHADE == 1
out vec4 vShadow;
#endif
void main() {
  gl_Position = clipFromWorld * vec4(position, 1);
  vDirect = directGloss;
  vAmbient = ambientRadius;
  vHalfway = vec4(halfwayBias.xyz, .99 * uvDetailSeam.w);
  vUv = vec4(uvDetailSeam.xy, surface.xy * uvDetailSeam.z);
  fTint = vec4(tint, surface.z);
  fLobes = lobes;
#ifdef DULL
  float x = halfwayBias.z * halfwayBias.z, d1 = x * lobes.x + 1., d2 = x * lobes.z + 1.;
  vDirect.rgb += directGloss.w * (lobes.y / (d1 * d1) + min(lobes.w / (d2 * d2), FILM_PEAK));
  vHalfway.xy *= surface.z;
#endif
#if SHADE == 2
  vAmbient.r += BLEED * surface.w * directGloss.r;  // as the edge's shader leaves it, or triangles would show
#endif
#if SHADE == 1
  vShadow = shadowFromWorld * vec4(position, 1);
  vShadow.z -= halfwayBias.w * vShadow.w;
  vShadow.xyz = .5 * (vShadow.xyz + vShadow.w);
#endif
}
)";

const char* const kTissueFragmentShader = R"(
noperspective in vec4 vDirect;
noperspective in vec4 vAmbient;
noperspective in vec4 vHalfway;
noperspective in vec4 vUv;
flat in vec4 fTint;
flat in vec4 fLobes;
out vec4 pixel;
uniform float opacity;
uniform sampler2D detail;
#if SHADE == 1
in vec4 vShadow;
uniform sampler2D shadowMap;
uniform vec4 surface;
uniform int squares;

// Share of the four texels around q.xy, in texels, that are not nearer than q.z. Blended here: OpenGL takes depths into
// a texture of depth one by one, those of a float as they are.
float litAt(vec2 q, float z) {
  vec4 near = vec4(lessThanEqual(vec4(z), textureGather(shadowMap, q * vec2(1. / SHADOW_WIDTH, 1. / SHADOW_HEIGHT))));
  vec2 w = fract(q - .5);
  vec2 rows = mix(near.wx, near.zy, w.x);
  return mix(rows.x, rows.y, w.y);
}

#ifdef SUPERSAMPLED
// By an eighth of a half turn more in each of the four pixels that become one: together they have four times the taps.
mat2 turnedBy(float r) {
  ivec2 odd = ivec2(gl_FragCoord.xy) & 1;
  vec2 c = r * (odd.x == 0 ? (odd.y == 0 ? vec2(1., 0.) : vec2(.92388, .38268))
                           : (odd.y == 0 ? vec2(.70711, .70711) : vec2(.38268, .92388)));
  return mat2(c.x, c.y, -c.y, c.x);
}
#else
float turnedBy(float r) { return r; }
#endif

// Taps on turned squares and in the middle, evenly spread over the disc: on a ring, the shadows of shafts as thick as it
// is wide have a dark line along their middle. A rotation per pixel would hide their steps better but leaves a pattern.
// Most pixels agree on the widest squares and are done (of four, on two: on one, the shadows of thin tools fell to
// pieces): llvmpipe runs both sides of a branch but leaves a loop when all its pixels do, so the squares are a loop
// whose length the compiler cannot know. SQUARE: a corner of the k-th, in a disc of radius 1; WIDEST: the last without
// which no pixel is done.
float softShadow(vec3 p, float r) {
  vec2 q = p.xy * SHADOW_HEIGHT;
  float sum = litAt(q, p.z), taps = 1.;
  for (int k = 0; k < squares; ++k) {
    vec2 d = turnedBy(r) * (SQUARE);
    sum += litAt(q + d, p.z) + litAt(q - d, p.z) + litAt(q + vec2(-d.y, d.x), p.z) + litAt(q + vec2(d.y, -d.x), p.z);
    taps += 4.;
    if (k >= WIDEST && (sum == 0. || sum == taps)) break;
  }
  return sum / taps;
}
#endif

void main() {
  vec4 t = texture(detail, vUv.xy);
  vec3 detailColour = mix(vec3(1. + vUv.z * (t.x - .5)), fTint.rgb, t.y * vUv.w);
#if SHADE == 2
  vec3 colour = detailColour * vAmbient.rgb;
#else
#ifdef DULL
  float along = dot(t.zw - .5, vHalfway.xy);
#else
  vec2 slope = (t.zw - .5) * fTint.w;
  float along = dot(slope, vHalfway.xy);
  float h = max(vHalfway.z - along, 0.);
  // Between tangents that oppose each other nothing is left of the unit vector but z: divided by that, it would mirror
  // the lamp whatever the angle.
  float x = h * h / ((1. + dot(slope, slope)) * max(dot(vHalfway.xyz, vHalfway.xyz), vHalfway.w));
  float d1 = x * fLobes.x + 1., d2 = x * fLobes.z + 1.;
  float gloss = vDirect.w * (fLobes.y / (d1 * d1) + min(fLobes.w / (d2 * d2), FILM_PEAK));
#endif
  vec3 diffuse = vDirect.rgb * (1. - along * .9);
#if SHADE == 1
  vec3 fromLamp = vShadow.xyz / vShadow.w;
  float s = softShadow(vec3(fromLamp.xy, min(fromLamp.z, 1.)), vAmbient.w);
  // Light bleeds into the shadow's edge through the tissue, and red light farthest.
  diffuse *= vec3(mix(s, mix(s, s * (2. - s), .6) * (1. - BLEED) + BLEED, surface.w), s, s);
#ifndef DULL
  gloss *= s;
#endif
#endif
  vec3 colour = detailColour * (diffuse + vAmbient.rgb);
#ifndef DULL
  colour += gloss * vec3(1., .97, .93);
#endif
#endif
  pixel = vec4(toneCurve(colour), opacity);
}
)";

const char* const kMaskVertexShader = R"(
layout(location = 0) in vec2 position;
void main() { gl_Position = vec4(position, -1, 1); }
)";
const char* const kMaskFragmentShader = R"(
out vec4 pixel;
void main() { pixel = vec4(0, 0, 0, 1); }
)";

// A unit sphere or a unit cylinder along z, placed by a 3x4 matrix per instance.
const char* const kModelVertexShader = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 row0;
layout(location = 3) in vec4 row1;
layout(location = 4) in vec4 row2;
layout(location = 5) in vec4 colour;
uniform mat4 clipFromWorld;
uniform vec3 eye;
uniform float nearer;
out vec3 vNormal;
out vec3 vPosition;
flat out vec4 vColour;
void main() {
  vec4 p = vec4(position, 1);
  vPosition = vec3(dot(row0, p), dot(row1, p), dot(row2, p));
  vec3 x = vec3(row0.x, row1.x, row2.x), z = vec3(row0.z, row1.z, row2.z), y = vec3(row0.y, row1.y, row2.y);
  vNormal = x * (normal.x / dot(x, x)) + y * (normal.y / dot(y, y)) + z * (normal.z / dot(z, z));
  vColour = colour;
  gl_Position = clipFromWorld * vec4(mix(vPosition, eye, nearer), 1);
}
)";

// Studio light: a large key from above the camera, a cool fill from below, a soft highlight and a darker outline. Lines
// of a pixel face the eye: a pixel sees now one, now another side of such a rod, and it would be dotted.
const char* const kModelFragmentShader = R"(
in vec3 vNormal;
in vec3 vPosition;
flat in vec4 vColour;
out vec4 pixel;
uniform vec3 eye, right, up, back;
uniform bool lines;
void main() {
  vec3 v = normalize(eye - vPosition), n = lines ? v : normalize(vNormal);
  vec3 key = normalize(.45 * up - .35 * right + .8 * back);
  float wrap = max((dot(n, key) + .35) / 1.35, 0.);
  float facing = max(dot(n, v), 0.);
  vec3 fill = mix(vec3(.13, .14, .17), vec3(.27, .27, .26), dot(n, up) * .5 + .5);
  float gloss = pow(max(dot(n, normalize(key + v)), 0.), 60.);
  float outline = lines ? .4 : smoothstep(0., .55, facing);  // of a line both its sides and its middle
  vec3 c = vColour.rgb * (fill + .55 * wrap * wrap) * mix(.5, 1., outline) + .16 * gloss;
  pixel = vec4(toneCurve(c), mix(min(1., vColour.a * 1.8), vColour.a, outline));
}
)";

const char* const kHazeVertexShader = R"(
layout(location = 0) in vec2 place;
layout(location = 1) in vec3 colour;
noperspective out vec3 vColour;
void main() {
  vColour = colour;
  gl_Position = vec4(place, 1, 1);
}
)";
const char* const kHazeFragmentShader = R"(
noperspective in vec3 vColour;
out vec4 pixel;
void main() {
  pixel = vec4(toneCurve(vColour) + tremble(), 1);
}
)";

const char* const kBackdropVertexShader = R"(
out vec2 place;
void main() {
  place = vec2(gl_VertexID == 1 ? 3. : -1., gl_VertexID == 2 ? 3. : -1.);
  gl_Position = vec4(place, 1, 1);
}
)";
const char* const kBackdropFragmentShader = R"(
in vec2 place;
out vec4 pixel;
void main() {
  float r = dot(place, place);
  vec3 c = mix(vec3(.93, .94, .95), vec3(.66, .69, .73), clamp(.45 * r + .18 * place.y, 0., 1.));
  pixel = vec4(c + tremble(), 1);
}
)";

}  // namespace medulla
