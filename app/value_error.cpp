#include "app/value_error.h"

#include "app/files/input_error.h"
#include "app/files/text.h"

namespace medulla {

const OverriddenAttribute* overriddenAt(const Scene& scene, int line, const std::vector<std::string_view>& attributes) {
  for (const OverriddenAttribute& o : scene.overridden)
    if (o.line == line && isOneOf(o.attribute, attributes)) return &o;
  return nullptr;
}

std::runtime_error valueError(const Scene& scene, int line, const std::vector<std::string_view>& attributes,
                              const std::string& message) {
  if (const OverriddenAttribute* o = overriddenAt(scene, line, attributes))
    return inputError("--set " + o->path, 0, message);
  return inputError(scene.path, line, message);
}

}  // namespace medulla
