#pragma once

namespace medulla {

// A library that is loaded when it is needed. Were they linked, FFmpeg with the 130 libraries that it brings would take
// 0.2 s of every start, and Mesa with its compiler 0.08: most commands need neither. Stays loaded, since both leave
// things to the process's end.
class SharedLibrary {
 public:
  // As the loader finds it, libavcodec.so.59. Both throw std::runtime_error with the loader's own words.
  explicit SharedLibrary(const char* name);
  void* address(const char* symbol) const;

  // The library's function of that name.
  template <class Function>
  void find(const char* symbol, Function*& function) const {
    function = reinterpret_cast<Function*>(address(symbol));
  }

 private:
  void* handle_;
};

}  // namespace medulla
