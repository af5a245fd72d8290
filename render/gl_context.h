#pragma once

#include <memory>
#include <string>

namespace medulla {

// An OpenGL 3.3 core context without a window. Making one makes it current on the calling thread; everything is drawn
// into framebuffer objects, so that a context needs no surface of its own.
class GlContext {
 public:
  virtual ~GlContext() = default;
  virtual void makeCurrent() = 0;  // throws std::runtime_error
};

// `name`: auto (OSMesa, or EGL where that is not built in or cannot start), osmesa, egl. Throws std::runtime_error in
// one line that says of each why not.
std::unique_ptr<GlContext> makeGlContext(const std::string& name);

// Mesa's software rasteriser runs one worker per core, and the kernel often stacks two of them on one core for seconds,
// which doubles the time of a picture. Gives each worker a core of its own. Does nothing for other drivers.
void spreadRasterThreads();

std::unique_ptr<GlContext> makeOsmesaContext();  // gl_context_osmesa.cpp
std::unique_ptr<GlContext> makeEglContext();     // gl_context_egl.cpp

}  // namespace medulla
