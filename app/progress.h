#pragma once

#include <string>

namespace medulla {

// Progress of long work on standard error: a bar with the time left on a terminal, a line every few seconds elsewhere,
// nothing for work that ends within half a second there, within two elsewhere.
class Progress {
 public:
  Progress(std::string what, double total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void update(double done);
  void end();  // takes the bar off its line, for what is told next

 private:
  std::string text(double done, double elapsed) const;

  std::string what_, unit_;
  double total_;
  bool terminal_;
  bool drawn_ = false;
  double start_, last_;  // s, wallSeconds()
};

}  // namespace medulla
