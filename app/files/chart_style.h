#pragma once

#include <string>

// How all charts look.
namespace medulla {

// Okabe and Ito (2008): told apart by all kinds of eyes. The seventh is of our own.
inline constexpr const char *kBlue = "#0072b2", *kVermilion = "#d55e00", *kGreen = "#009e73", *kPurple = "#cc79a7",
                            *kOrange = "#e69f00", *kSky = "#56b4e9", *kOlive = "#999933";
inline constexpr const char* kCurveColours[] = {kBlue, kVermilion, kGreen, kPurple, kOrange, kSky, kOlive};
// Of axes and of what is no curve; what another program has computed.
inline constexpr const char *kGrey = "#555555", *kBlack = "#000000";

// The beginning of a script of gnuplot's: an SVG of so many pixels with a grid behind it.
std::string chartHead(double width, double height, int fontSize);

// Rows of numbers as gnuplot's $name.
std::string dataBlock(const std::string& name, const std::string& rows);

// A name as a chart shows it: blanks in the place of _.
std::string spaced(std::string name);

}  // namespace medulla
