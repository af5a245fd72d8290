#include "app/files/chart_style.h"

#include <fmt/format.h>

#include <algorithm>

namespace medulla {

std::string chartHead(double width, double height, int fontSize) {
  return fmt::format(
      "set terminal svg size {},{} dynamic noenhanced font 'Helvetica,{}' background 'white'\n"
      "set border 3 lc '{}'\nset tics nomirror out\nset grid xtics ytics lc '#dddddd' lt 1 lw 1\n",
      width, height, fontSize, kGrey);
}

std::string dataBlock(const std::string& name, const std::string& rows) {
  return fmt::format("${} << EOD\n{}EOD\n", name, rows);
}

std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

}  // namespace medulla
