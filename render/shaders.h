#pragma once

#include <cstddef>
#include <string>

// GLSL 3.30 sources. `defines` are lines "#define NAME VALUE\n" put under the version line.
namespace medulla {

// OpenGL takes offsets into buffers as pointers.
inline const void* bufferOffset(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);  // NOLINT(performance-no-int-to-ptr)
}

// What a shader reads at `location`: so many floats, `offset` bytes into each `stride` bytes of the array buffer bound.
void readAttribute(unsigned location, int floats, std::size_t stride, std::size_t offset);

unsigned buildProgram(const std::string& defines, const char* vertex, const char* fragment);  // throws with GLSL's log

// Tissue and steel. SHADE 0 lit, 1 shadow edge, 2 dark; DULL: no highlight can be seen.
extern const char *const kTissueVertexShader, *const kTissueFragmentShader;
// Covers what lies outside the round picture at the near plane: those pixels are never shaded.
extern const char *const kMaskVertexShader, *const kMaskFragmentShader;
// Balls and segments of the model view, instanced.
extern const char *const kModelVertexShader, *const kModelFragmentShader;
// Background of haze: colours at the corners of a grid, with a tremble below one grey level that hides the steps.
extern const char *const kHazeVertexShader, *const kHazeFragmentShader;
// Background of the model view: one triangle.
extern const char *const kBackdropVertexShader, *const kBackdropFragmentShader;

}  // namespace medulla
