#pragma once

#include <optional>
#include <vector>

namespace medulla {

// Keeps the labels of a chart off its marks and off one another. Pixels, x to the right, y upwards.
class ChartLabels {
 public:
  struct Place {
    double x = 0, y = 0;
  };

  // Marks, and lines between them, that labels leave free.
  void addMark(Place centre);
  void addLine(Place from, Place to);
  // The centre of a label of so many characters at a mark: above it, below, to its right or left, whichever is free
  // first; nothing, and the label is better left out, where none is.
  std::optional<Place> place(Place mark, std::size_t characters);

 private:
  struct Box {
    Place low, high;
  };
  bool isFree(const Box& box) const;

  std::vector<Box> taken_;
};

}  // namespace medulla
