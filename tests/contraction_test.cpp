#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>

// What the compiler did to arithmetic that no test of values would catch for sure.
namespace medulla {

// Whether an instruction of this function fuses what the source does not: the program's own multiply-adds are asked for
// by name, four or two doubles at a time, and Eigen's products of matrices have single ones. Nobody asks for a product
// less a sum, so that every such instruction is the compiler's.
static bool fusesUnasked(const std::string& instruction, const std::string& function) {
  if (instruction.starts_with("vfmsub") || instruction.starts_with("vfnmsub")) return true;
  if (!instruction.starts_with("vfmadd") && !instruction.starts_with("vfnmadd")) return false;
  if (instruction.starts_with("vfmaddsub")) return true;
  if (instruction.ends_with("sd")) return function.find("gebp") == std::string::npos;
  return !instruction.ends_with("pd");
}

// A fused a b + c differs from the product and sum it stands for in the last bit, so that hashes would hang on compiler
// and options.
TEST(Contraction, NoInstructionFusesWhatTheSourceDoesNot) {
  const std::unique_ptr<FILE, int (*)(FILE*)> listing(
      popen("objdump -dC --no-show-raw-insn '" MEDULLA_PROGRAM "'", "r"), pclose);
  ASSERT_NE(listing, nullptr);
  std::array<char, 4096> part;
  std::string line, function, fused;
  int known = 0;
  while (fgets(part.data(), part.size(), listing.get()) != nullptr) {
    line += part.data();
    if (!line.ends_with('\n')) continue;  // names of Eigen's functions are longer than any buffer
    if (line.ends_with(">:\n")) function = line;
    std::istringstream words(line);
    std::string address, instruction;
    words >> address >> instruction;
    known += instruction.starts_with("vfmadd");
    if (fusesUnasked(instruction, function)) fused.append(instruction).append(" in ").append(function);
    line.clear();
  }
  EXPECT_GT(known, 100) << "objdump did not list the program's instructions";
  EXPECT_EQ(fused.substr(0, 2000), "") << "compile with -ffp-contract=off, and this function's source with "
                                          "-fno-tree-slp-vectorize, as CMakeLists.txt does";
}

}  // namespace medulla
