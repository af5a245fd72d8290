#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "app/scene.h"

namespace medulla {

// nullptr where what this element says of these attributes is the file's.
const OverriddenAttribute* overriddenAt(const Scene& scene, const ElementPlace& at,
                                        const std::vector<std::string_view>& attributes);

// Of values that turn out to be wrong only once files are read: said where they stand, in the scene file or, if one of
// them does, on the command line.
std::runtime_error valueError(const Scene& scene, const ElementPlace& at,
                              const std::vector<std::string_view>& attributes, const std::string& message);

}  // namespace medulla
