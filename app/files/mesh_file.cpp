#include "app/files/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "app/files/assimp_reader.h"
#include "app/files/input_error.h"
#include "app/files/obj_reader.h"
#include "app/files/off_reader.h"

namespace medulla {

namespace {

std::string extensionOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// Complains in the words of the file system, before any reader sees the path.
void requireReadableFile(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw inputError(path, 0, "cannot be read: " + (error ? error.message() : std::string(std::strerror(ENOENT))));
  }
  if (std::filesystem::is_directory(status)) throw inputError(path, 0, "is a directory, expected a mesh file");
  if (!std::filesystem::is_regular_file(status)) throw inputError(path, 0, "is not a file, expected a mesh file");
  errno = 0;
  if (!std::ifstream(path).is_open()) throw inputError(path, 0, std::string("cannot be read: ") + std::strerror(errno));
  if (std::filesystem::file_size(path, error) == 0 && !error) throw inputError(path, 0, "is empty");
}

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) throw inputError(path, 0, "reading failed");
  return text;
}

}  // namespace

double metresPerUnit(const std::string& unit) {
  if (unit == "m") return 1;
  if (unit == "cm") return 0.01;
  if (unit == "mm") return 0.001;
  if (unit == "inch") return 0.0254;
  throw std::runtime_error("unknown unit '" + unit + "', expected m, cm, mm or inch");
}

TriangleMesh readMesh(const std::string& path, double metresPerFileUnit) {
  requireReadableFile(path);
  const std::string extension = extensionOf(path);
  TriangleMesh mesh;
  if (extension == ".obj") {
    mesh = parseObj(readText(path), path);
  } else if (extension == ".off") {
    mesh = parseOff(readText(path), path);
  } else if (assimpReads(extension)) {
    mesh = readWithAssimp(path);
  } else {
    throw inputError(
        path, 0,
        "unknown mesh format '" + extension + "', expected .obj, .off, .stl, .ply or another that assimp reads");
  }
  for (auto& vertex : mesh.vertices) vertex *= metresPerFileUnit;
  return mesh;
}

}  // namespace medulla
