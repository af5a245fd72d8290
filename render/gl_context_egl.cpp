#ifdef MEDULLA_HAVE_EGL

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <stdexcept>

#include "render/gl_context.h"
#include "render/gl_functions.h"

namespace medulla {
namespace {

class EglContext : public GlContext {
 public:
  EglContext() {
    const auto getPlatformDisplay =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (!getPlatformDisplay) throw std::runtime_error("EGL has no platform displays (EGL_EXT_platform_base)");
    display_ = getPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr))
      throw std::runtime_error("EGL could not open a surfaceless display (EGL_MESA_platform_surfaceless)");
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    if (eglBindAPI(EGL_OPENGL_API))
      context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context_ == EGL_NO_CONTEXT) throw std::runtime_error("EGL could not make an OpenGL 3.3 core context");
    EglContext::makeCurrent();  // by name: virtual dispatch does not reach further in a constructor
  }
  // The display is shared by the process and stays open: eglTerminate would pull it from under other contexts.
  ~EglContext() override {
    if (eglGetCurrentContext() == context_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
  void makeCurrent() override {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      throw std::runtime_error("EGL could not make its context current");
    useGlFunctionsOf(eglGetProcAddress);
  }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<GlContext> makeEglContext() {
  return std::make_unique<EglContext>();
}

}  // namespace medulla

#endif
