#ifdef MEDULLA_HAVE_OSMESA

#include <GL/osmesa.h>

#include <array>
#include <stdexcept>

#include "render/gl_context.h"
#include "render/gl_functions.h"
#include "render/shared_library.h"

namespace medulla {
namespace {

// What is called of OSMesa.
struct Osmesa {
  decltype(&OSMesaCreateContextAttribs) createContextAttribs;
  decltype(&OSMesaDestroyContext) destroyContext;
  decltype(&OSMesaMakeCurrent) makeCurrent;
  decltype(&OSMesaGetProcAddress) getProcAddress;

  Osmesa() {
    const SharedLibrary library("libOSMesa.so.8");
    library.find("OSMesaCreateContextAttribs", createContextAttribs);
    library.find("OSMesaDestroyContext", destroyContext);
    library.find("OSMesaMakeCurrent", makeCurrent);
    library.find("OSMesaGetProcAddress", getProcAddress);
  }
};

const Osmesa& osmesa() {
  static const Osmesa library;
  return library;
}

class OsmesaContext : public GlContext {
 public:
  OsmesaContext() {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    context_ = osmesa().createContextAttribs(attributes, nullptr);
    if (!context_) throw std::runtime_error("OSMesa could not make an OpenGL 3.3 core context");
    OsmesaContext::makeCurrent();  // by name: virtual dispatch does not reach further in a constructor
  }
  ~OsmesaContext() override { osmesa().destroyContext(context_); }
  void makeCurrent() override {
    if (!osmesa().makeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide))
      throw std::runtime_error("OSMesa could not make its context current");
    useGlFunctionsOf(osmesa().getProcAddress);
  }

 private:
  // OSMesa insists on a default framebuffer; nothing is drawn into it.
  static constexpr int kSide = 16;
  std::array<unsigned char, 4 * kSide * kSide> buffer_{};
  OSMesaContext context_ = nullptr;
};

}  // namespace

std::unique_ptr<GlContext> makeOsmesaContext() {
  return std::make_unique<OsmesaContext>();
}

}  // namespace medulla

#endif
