#include "app/value_error.h"

#include "app/files/input_error.h"
#include "app/files/text.h"

namespace medulla {

const OverriddenAttribute* overriddenAt(const Scene& scene, const ElementPlace& at,
                                        const std::vector<std::string_view>& attributes) {
  for (const OverriddenAttribute& o : scene.overridden)
    if (o.place == at && isOneOf(o.attribute, attributes)) return &o;
  return nullptr;
}

std::runtime_error valueError(const Scene& scene, const ElementPlace& at,
                              const std::vector<std::string_view>& attributes, const std::string& message) {
  if (const OverriddenAttribute* o = overriddenAt(scene, at, attributes))
    return inputError("--set " + o->path, 0, message);
  return inputError(scene.path, at.line, message);
}

}  // namespace medulla
