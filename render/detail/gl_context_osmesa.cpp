#include "render/detail/gl_context.h"

#include <GL/osmesa.h>

#include <cstdlib>
#include <mutex>

#include "core/error.h"

namespace limber::render::detail {

namespace {

// Read by llvmpipe when the first context is made. LP_NATIVE_VECTOR_WIDTH=512 has crashed Mesa 22.3. Without
// LP_NUM_THREADS every process would start as many threads as the machine has, though frames are already
// shared out among our own.
void prepare_environment() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::unsetenv("LP_NATIVE_VECTOR_WIDTH");
    ::setenv("LP_NUM_THREADS", "0", 0);
  });
}

}  // namespace

struct GlContext::Backend {
  OSMesaContext context;
  unsigned char
      unused_pixels[4 * 16 * 16];  // OSMesa insists on a buffer; all drawing goes to framebuffer objects
};

GlContext::GlContext() : backend_(std::make_unique<Backend>()) {
  prepare_environment();
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            0,
                            OSMESA_STENCIL_BITS,
                            0,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            4,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            4,
                            0};
  backend_->context = OSMesaCreateContextAttribs(attributes, nullptr);
  if (!backend_->context)
    throw InputError("OSMesa gives no OpenGL 4.4 context; is libosmesa6 of Mesa 22 installed?");
  make_current();
}

GlContext::~GlContext() { OSMesaDestroyContext(backend_->context); }

void GlContext::make_current() {
  if (OSMesaGetCurrentContext() == backend_->context) return;
  if (!OSMesaMakeCurrent(backend_->context, backend_->unused_pixels, GL_UNSIGNED_BYTE, 16, 16))
    throw InputError("OSMesa refuses to make its context current; is libosmesa6 of Mesa 22 installed?");
}

}  // namespace limber::render::detail
