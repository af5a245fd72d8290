#include "app/files/state_cache.h"

#include <fmt/format.h>

#include <bit>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string_view>
#include <type_traits>

#include "app/files/input_error.h"
#include "app/tool_fields.h"
#include "physics/content_hash.h"

namespace medulla {

namespace {

constexpr std::string_view kMagic = "medulla cache";
constexpr std::uint32_t kFormat = 2;
constexpr std::size_t kTailSize = 3 * sizeof(std::uint64_t);
constexpr std::uint32_t kNamesMost = 100000, kNameLongest = 4096;  // bodies, tools; bytes
static_assert(std::endian::native == std::endian::little);

// One description of a record serves both ways: `Bytes` either appends what it is shown, or fills it in.
class Appender {
 public:
  static constexpr bool reads = false;
  explicit Appender(std::string& out) : out_(&out) {}
  template <typename T>
  void raw(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    out_->append(reinterpret_cast<const char*>(&value), sizeof value);
  }

 private:
  std::string* out_;
};

class Taker {
 public:
  static constexpr bool reads = true;
  explicit Taker(std::string_view bytes) : bytes_(bytes) {}
  std::size_t left() const { return bytes_.size(); }
  // Once the bytes are over: zeros, and ranShort() says so.
  template <typename T>
  void raw(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    value = T{};
    short_ = short_ || bytes_.size() < sizeof value;
    if (short_) return;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(sizeof value);
  }
  std::string text(std::size_t size) {
    short_ = short_ || bytes_.size() < size;
    if (short_) return {};
    std::string out(bytes_.substr(0, size));
    bytes_.remove_prefix(size);
    return out;
  }
  bool ranShort() const { return short_; }

 private:
  std::string_view bytes_;
  bool short_ = false;
};

template <typename Bytes, typename Vector>
void exchangeVector(Bytes& bytes, Vector& v) {
  for (int a = 0; a < 3; ++a) bytes.raw(v[a]);
}

template <typename Bytes, typename Quaternion>
void exchangeQuaternion(Bytes& bytes, Quaternion& q) {
  for (int a = 0; a < 4; ++a) bytes.raw(q.coeffs()[a]);
}

// Nodes as floats.
template <typename Bytes, typename Vector>
void exchangeNode(Bytes& bytes, Vector& node) {
  for (int a = 0; a < 3; ++a) {
    float value = 0;
    if constexpr (!Bytes::reads) value = static_cast<float>(node[a]);
    bytes.raw(value);
    if constexpr (Bytes::reads) node[a] = value;
  }
}

template <typename Bytes, typename Flag>
void exchangeFlag(Bytes& bytes, Flag& flag) {
  std::uint8_t value = flag ? 1 : 0;
  bytes.raw(value);
  if constexpr (Bytes::reads) flag = value != 0;
}

template <typename Bytes, typename Input, typename Tool>
void exchangeTool(Bytes& bytes, Input& input, Tool& tool) {
  visitToolFields(input, tool, [&bytes](const char*, auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, double>)
      bytes.raw(value);
    else if constexpr (std::is_same_v<Value, bool>)
      exchangeFlag(bytes, value);
    else if constexpr (std::is_same_v<Value, Eigen::Quaterniond>)
      exchangeQuaternion(bytes, value);
    else
      exchangeVector(bytes, value);
  });
}

std::size_t sizeOfTool() {
  std::string bytes;
  Appender to(bytes);
  const ToolSample input;
  const ToolState tool;
  exchangeTool(to, input, tool);
  return bytes.size();
}

// `state` has the layout's sizes.
template <typename Bytes, typename State, typename Hash>
void exchangeRecord(Bytes& bytes, State& state, Hash& stateHash) {
  bytes.raw(state.time);
  bytes.raw(stateHash);
  for (auto& body : state.frame.bodies) {
    for (auto& sphere : body.spheres) {
      exchangeVector(bytes, sphere.position);
      exchangeQuaternion(bytes, sphere.worldFromSphere);
    }
    for (auto& node : body.nodes) exchangeNode(bytes, node);
  }
  for (std::size_t k = 0; k < state.tools.size(); ++k) exchangeTool(bytes, state.inputs[k], state.tools[k]);
}

void resize(const CacheLayout& layout, PictureState& state) {
  state.frame.bodies.resize(layout.bodies.size());
  for (std::size_t b = 0; b < layout.bodies.size(); ++b) {
    state.frame.bodies[b].spheres.resize(layout.bodies[b].spheres);
    state.frame.bodies[b].nodes.resize(layout.bodies[b].nodes);
  }
  state.inputs.resize(layout.tools.size());
  state.tools.resize(layout.tools.size());
}

// Bytes of a record with its checksum; as double, since counts in a broken file may be anything.
double recordSizeOf(const CacheLayout& layout) {
  constexpr double d = sizeof(double), f = sizeof(float), pose = 7 * d;
  double size = 3 * d + double(sizeOfTool()) * double(layout.tools.size());
  for (const CacheLayout::Body& body : layout.bodies) size += pose * body.spheres + 3 * f * body.nodes;
  return size;
}

void appendName(std::string& out, const std::string& name) {
  Appender(out).raw(static_cast<std::uint32_t>(name.size()));
  out += name;
}

std::string headOf(const CacheLayout& layout) {
  std::string out(kMagic);
  Appender to(out);
  to.raw(kFormat);
  to.raw(layout.motionHash);
  to.raw(layout.fps);
  to.raw(static_cast<std::uint32_t>(layout.bodies.size()));
  to.raw(static_cast<std::uint32_t>(layout.tools.size()));
  for (const CacheLayout::Body& body : layout.bodies) {
    appendName(out, body.name);
    to.raw(static_cast<std::uint32_t>(body.spheres));
    to.raw(static_cast<std::uint32_t>(body.nodes));
  }
  for (const std::string& tool : layout.tools) appendName(out, tool);
  return out;
}

// False where the bytes end too early or make no sense.
bool readName(Taker& from, std::string& name) {
  std::uint32_t size = 0;
  from.raw(size);
  if (from.ranShort() || size > kNameLongest) return false;
  name = from.text(size);
  return !from.ranShort();
}

bool readHead(Taker& from, CacheLayout& layout) {
  std::uint32_t bodies = 0, tools = 0;
  from.raw(layout.motionHash);
  from.raw(layout.fps);
  from.raw(bodies);
  from.raw(tools);
  if (from.ranShort() || !(layout.fps > 0) || !std::isfinite(layout.fps) || bodies > kNamesMost || tools > kNamesMost)
    return false;
  for (std::uint32_t b = 0; b < bodies; ++b) {
    CacheLayout::Body body;
    std::uint32_t spheres = 0, nodes = 0;
    if (!readName(from, body.name)) return false;
    from.raw(spheres);
    from.raw(nodes);
    constexpr std::uint32_t most = std::numeric_limits<int>::max();
    if (from.ranShort() || spheres > most || nodes > most) return false;
    body.spheres = static_cast<int>(spheres);
    body.nodes = static_cast<int>(nodes);
    layout.bodies.push_back(std::move(body));
  }
  for (std::uint32_t t = 0; t < tools; ++t)
    if (!readName(from, layout.tools.emplace_back())) return false;
  return true;
}

}  // namespace

CacheWriter::CacheWriter(const std::string& path, const CacheLayout& layout) : file_(path), head_(headOf(layout)) {
  file_.write(head_);
}

void CacheWriter::write(const PictureState& state, std::uint64_t stateHash) {
  std::string record;
  Appender to(record);
  exchangeRecord(to, state, stateHash);
  to.raw(contentHash(record));
  file_.write(record);
  ++pictures_;
}

void CacheWriter::finish(std::uint64_t finalHash) {
  std::string tail;
  Appender to(tail);
  to.raw(pictures_);
  to.raw(finalHash);
  to.raw(contentHash(tail, contentHash(head_)));
  file_.write(tail);
  file_.finish();
}

CacheReader::CacheReader(const std::string& path) : path_(path) {
  std::error_code missing;
  const std::filesystem::file_status status = std::filesystem::status(path, missing);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    throw inputError(path, 0, "is not a file, expected one that medulla replay --cache wrote");
  file_.open(path, std::ios::binary | std::ios::ate);
  const std::streamoff end = file_ ? static_cast<std::streamoff>(file_.tellg()) : -1;
  if (end < 0) throw inputError(path, 0, std::string("cannot be opened: ") + std::strerror(errno));
  const auto size = static_cast<std::size_t>(end);
  // Names are short: the head of any scene that runs fits into this.
  constexpr std::size_t headMost = 1 << 24;
  std::string bytes(std::min(size, headMost), '\0');
  file_.seekg(0);
  if (!file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw inputError(path, 0, "cannot be read");
  if (!bytes.starts_with(kMagic))
    throw inputError(path, 0, "this is no state cache, expected a file that medulla replay --cache wrote");
  Taker from(std::string_view(bytes).substr(kMagic.size()));
  std::uint32_t format = 0;
  from.raw(format);
  if (format != kFormat)
    throw inputError(path, 0, fmt::format("state cache of format {}, expected {}: write it anew", format, kFormat));
  const bool whole = readHead(from, layout_);
  headSize_ = bytes.size() - from.left();
  const double record = recordSizeOf(layout_);
  if (!whole || headSize_ + kTailSize > size || record > static_cast<double>(size))
    throw inputError(path, 0, "this state cache is cut off or broken: write it anew");
  recordSize_ = static_cast<std::size_t>(record);

  std::string tail(kTailSize, '\0');
  file_.seekg(static_cast<std::streamoff>(size - kTailSize));
  file_.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  Taker last(tail);
  std::uint64_t pictures = 0, checksum = 0;
  last.raw(pictures);
  last.raw(finalHash_);
  last.raw(checksum);
  const std::string_view checked = std::string_view(tail).substr(0, kTailSize - sizeof checksum);
  if (!file_ || checksum != contentHash(checked, contentHash(std::string_view(bytes).substr(0, headSize_))) ||
      pictures < 1 || pictures > std::numeric_limits<int>::max() ||
      pictures != (size - headSize_ - kTailSize) / recordSize_ || (size - headSize_ - kTailSize) % recordSize_ != 0)
    throw inputError(path, 0, "this state cache is cut off or broken: write it anew");
  pictures_ = static_cast<int>(pictures);
}

std::uint64_t CacheReader::read(int number, PictureState& state) {
  assert(number >= 0 && number < pictures_);
  record_.resize(recordSize_);
  file_.seekg(static_cast<std::streamoff>(headSize_ + number * recordSize_));
  file_.read(record_.data(), static_cast<std::streamsize>(record_.size()));
  resize(layout_, state);
  Taker from(record_);
  std::uint64_t stateHash = 0, checksum = 0;
  exchangeRecord(from, state, stateHash);
  from.raw(checksum);
  const std::string_view checked = std::string_view(record_).substr(0, recordSize_ - sizeof checksum);
  if (!file_ || from.ranShort() || checksum != contentHash(checked))
    throw inputError(path_, 0, fmt::format("picture {} of this state cache is broken: write it anew", number));
  state.frame.time = state.time;
  return stateHash;
}

bool isCache(const std::string& path) {
  std::error_code missing;
  if (!std::filesystem::is_regular_file(path, missing)) return false;  // opening a pipe would wait for its writer
  std::ifstream file(path, std::ios::binary);
  std::string start(kMagic.size(), '\0');
  return file.read(start.data(), static_cast<std::streamsize>(start.size())) && start == kMagic;
}

}  // namespace medulla
