#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

// What the compiler did to arithmetic that no test of values would catch for sure.
namespace medulla {

// A fused a b + c differs from the product and sum it stands for in the last bit, so that hashes would hang on compiler
// and options. The program's own multiply-adds are asked for by name and never of this kind.
TEST(Contraction, NoInstructionFusesWhatTheSourceDoesNot) {
  const std::unique_ptr<FILE, int (*)(FILE*)> listing(
      popen("objdump -dC --no-show-raw-insn '" MEDULLA_PROGRAM "'", "r"), pclose);
  ASSERT_NE(listing, nullptr);
  std::array<char, 4096> line;
  std::string function, fused;
  int known = 0;
  while (fgets(line.data(), line.size(), listing.get()) != nullptr) {
    const std::string text = line.data();
    if (text.ends_with(">:\n")) function = text;
    known += text.find("vfmadd") != std::string::npos;
    if (text.find("vfmaddsub") != std::string::npos || text.find("vfmsubadd") != std::string::npos) fused += function;
  }
  EXPECT_GT(known, 100) << "objdump did not list the program's instructions";
  EXPECT_EQ(fused, "") << "compile this function's source with -fno-tree-slp-vectorize, as CMakeLists.txt does others";
}

}  // namespace medulla
