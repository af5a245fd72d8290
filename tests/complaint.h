#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace medulla {

// What the action's error says, always one line, without the folder where it begins with a path in that; "" where there
// is none.
template <class Action>
std::string complaintOf(const Action& action, const std::string& folder = "") {
  try {
    action();
  } catch (const std::runtime_error& error) {
    const std::string message = error.what(), before = folder + "/";
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return !folder.empty() && message.starts_with(before) ? message.substr(before.size()) : message;
  }
  return "";
}

}  // namespace medulla
