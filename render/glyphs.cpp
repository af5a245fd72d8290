#include "render/glyphs.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>

namespace medulla {
namespace {

// Ascending.
constexpr Glyph kGlyphs[] = {
    {U' ', 3, ""},
    {U'!', 3, "0004 0606"},
    {U'"', 4, "0001 2021"},
    {U'#', 6, "1016 3036 0242 0444"},
    {U'$', 6, "413010010213334445361605 2026"},
    {U'%', 6, "0640 0010110100 3545463635"},
    {U'&', 6, "4612112031320405162644"},
    {U'\'', 2, "0001"},
    {U'(', 3, "10010516"},
    {U')', 3, "00111506"},
    {U'*', 6, "2024 0143 0341"},
    {U'+', 6, "0343 2125"},
    {U',', 3, "0607"},
    {U'-', 6, "1333"},
    {U'.', 3, "0606"},
    {U'/', 5, "0630"},
    {U'0', 6, "103041453616050110"},
    {U'1', 6, "112026"},
    {U'2', 6, "01103041420646"},
    {U'3', 6, "004022324345361605"},
    {U'4', 6, "36300444"},
    {U'5', 6, "400002324345361605"},
    {U'6', 6, "30110305163645443303"},
    {U'7', 6, "004016"},
    {U'8', 6, "103041423313020110 1304051636454433"},
    {U'9', 6, "16354341301001021343"},
    {U':', 3, "0303 0606"},
    {U';', 3, "0303 0607"},
    {U'<', 6, "410345"},
    {U'=', 6, "0242 0444"},
    {U'>', 6, "014305"},
    {U'?', 6, "01103041422324 2626"},
    {U'@', 6, "461605011030414434322213142434"},
    {U'A', 6, "062046 1434"},
    {U'B', 6, "06003041423303 3344453606"},
    {U'C', 6, "4130100105163645"},
    {U'D', 6, "06002042442606"},
    {U'E', 6, "40000646 0333"},
    {U'F', 6, "400006 0333"},
    {U'G', 6, "41301001051636454323"},
    {U'H', 6, "0006 4046 0343"},
    {U'I', 4, "1016"},
    {U'J', 6, "4045361605"},
    {U'K', 6, "0006 400346"},
    {U'L', 6, "000646"},
    {U'M', 6, "0600234046"},
    {U'N', 6, "06004640"},
    {U'O', 6, "20414526050120"},
    {U'P', 6, "06003041423303"},
    {U'Q', 6, "20414526050120 2446"},
    {U'R', 6, "06003041423303 2346"},
    {U'S', 6, "413010010213334445361605"},
    {U'T', 6, "0040 2026"},
    {U'U', 6, "000516364540"},
    {U'V', 6, "002640"},
    {U'W', 6, "0016223640"},
    {U'X', 6, "0046 4006"},
    {U'Y', 6, "002340 2326"},
    {U'Z', 6, "00400646"},
    {U'[', 3, "10000616"},
    {U'\\', 5, "0036"},
    {U']', 3, "00101606"},
    {U'^', 6, "022042"},
    {U'_', 6, "0747"},
    {U'`', 3, "0011"},
    {U'a', 5, "3322120305162635 3236"},
    {U'b', 5, "0006 0312223335261605"},
    {U'c', 5, "3322120305162635"},
    {U'd', 5, "3036 3322120305162635"},
    {U'e', 5, "04343322120305162635"},
    {U'f', 4, "30201116 0222"},
    {U'g', 5, "3322120305162635 3237281807"},
    {U'h', 5, "0006 0312223336"},
    {U'i', 2, "0206 0000"},
    {U'j', 3, "121708 1010"},
    {U'k', 5, "0006 320436"},
    {U'l', 2, "0006"},
    {U'm', 6, "0206 03122326 23324346"},
    {U'n', 5, "0206 0312223336"},
    {U'o', 5, "122233352616050312"},
    {U'p', 5, "0208 0312223335261605"},
    {U'q', 5, "3238 3322120305162635"},
    {U'r', 4, "0206 031222"},
    {U's', 5, "3212031424352606"},
    {U't', 4, "101526 0222"},
    {U'u', 5, "0205162635 3236"},
    {U'v', 6, "022642"},
    {U'w', 6, "0216243642"},
    {U'x', 5, "0236 3206"},
    {U'y', 6, "0226 4218"},
    {U'z', 5, "02320636"},
    {U'{', 4, "20111203141526"},
    {U'|', 2, "0007"},
    {U'}', 4, "00111223141506"},
    {U'~', 6, "04133443"},
    {U'«', 5, "221426 423446"},
    {U'°', 3, "1021120110"},
    {U'±', 6, "0343 2125 0646"},
    {U'²', 3, "001020110222"},
    {U'³', 3, "002011222103"},
    {U'µ', 5, "0208 05162635 3236"},
    {U'·', 2, "0303"},
    {U'»', 5, "122416 324436"},
    {U'Æ', 8, "063060 303666 3353 1434"},
    {U'×', 6, "1236 3216"},
    {U'Þ', 6, "0006 013142433404"},
    {U'ß', 5, "06011020312233352616"},
    {U'æ', 8, "3322120305162635 3236 34646352423335465665"},
    {U'÷', 6, "0343 2121 2525"},
    {U'þ', 5, "0008 0312223335261605"},
    {U'ď', 7, "3036 3322120305162635 5051"},
    {U'Ħ', 8, "1016 5056 1353 0161"},
    {U'ħ', 6, "1016 1322324346 0131"},
    {U'ı', 2, "0206"},
    {U'Ľ', 6, "000646 3031"},
    {U'ľ', 5, "0006 2021"},
    {U'ł', 3, "1016 0422"},
    {U'Ŋ', 6, "0006 01103041473827"},
    {U'ŋ', 5, "0206 03122233372818"},
    {U'Œ', 10, "20414526050120 80404686 4373"},
    {U'œ', 8, "122233352616050312 34646352423335465665"},
    {U'ť', 6, "101526 0222 4041"},
    {U'Ŧ', 6, "0040 2026 1333"},
    {U'ŧ', 4, "101526 0222 0424"},
    {U'ȷ', 3, "121708"},
    {U'ẞ', 6, "0601103041233344453616"},
    {U'–', 5, "0434"},
    {U'—', 7, "0454"},
    {U'‘', 2, "0100"},
    {U'’', 2, "0001"},
    {U'“', 4, "0100 2120"},
    {U'”', 4, "0001 2021"},
    {U'„', 4, "0607 2627"},
    {U'…', 6, "0606 2626 4646"},
    {U'€', 6, "5140201115264655 0333 0434"},
};
constexpr Glyph kBox{U'\0', 6, "0040460600"};

// What letters of other alphabets have above, below or across: each second character is one that carries the mark, and
// the one behind it is what is drawn with it. Points as a glyph's, of one that reaches from 0 to 3; what is above goes
// by half steps.
struct Mark {
  const char* strokes;
  bool isAbove;
  const char32_t* letters;
};
constexpr Mark kMarks[] = {
    {"2042", true, U"ÀAÈEÌIÒOÙUàaèeìıòoùu"},
    {"2240", true, U"ÁAÉEÍIÓOÚUÝYĆCĹLŃNŔRŚSŹZáaéeíıóoúuýyćcĺlńnŕrśsźz"},
    {"123052", true, U"ÂAÊEÎIÔOÛUĈCĜGĤHĴJŜSŴWŶYâaêeîıôoûuĉcĝgĥhĵȷŝsŵwŷy"},
    {"02214261", true, U"ÃAÑNÕOĨIŨUãañnõoĩıũu"},
    {"1111 5151", true, U"ÄAËEÏIÖOÜUŸYäaëeïıöoüuÿy"},
    {"204051524323121120", true, U"ÅAŮUåaůu"},
    {"103250", true, U"ČCĎDĚEŇNŘRŠSŤTŽZčcěeňnřršsžz"},
    {"10224250", true, U"ĂAĞGĔEĬIŎOŬUăağgĕeĭıŏoŭu"},
    {"3131", true, U"ĊCĖEĠGİIŻZċcėeġgżz"},
    {"1230 4260", true, U"ŐOŰUőoűu"},
    {"1151", true, U"ĀAĒEĪIŌOŪUāaēeīıōoūu"},
    {"262718", false, U"ÇCŞSŢTȘSȚTçcşsţtșsțt"},
    {"2718", false, U"ĢGĶKĻLŅNŖRķkļlņnŗr"},
    {"4022", true, U"ģg"},
    {"362738", false, U"ĄAĘEĮIŲUąaęeįiųu"},
    {"0632", false, U"ØOøo"},
    {"0412", false, U"ŁL"},
    {"0323", false, U"ĐDÐDðd"},
    {"2141", false, U"đd"},
};

const Glyph* findGlyph(char32_t character) {
  const auto* found = std::lower_bound(std::begin(kGlyphs), std::end(kGlyphs), character,
                                       [](const Glyph& g, char32_t c) { return g.character < c; });
  return found != std::end(kGlyphs) && found->character == character ? found : nullptr;
}

std::optional<Letter> findLetter(char32_t character) {
  if (const Glyph* glyph = findGlyph(character)) return Letter{glyph};
  for (const Mark& mark : kMarks)
    for (const char32_t* at = mark.letters; *at; at += 2)
      if (at[0] == character) {
        const Glyph* glyph = findGlyph(at[1]);
        const bool isTall = at[1] <= U'Z' || at[1] == U'h' || at[1] == U'l';
        return Letter{glyph,
                      mark.strokes,
                      mark.isAbove ? 0.5f : 1,
                      {0.5f * (glyph->advance - 5), mark.isAbove && isTall ? -2 : 0}};
      }
  return std::nullopt;
}

// The next character of UTF-8; of bytes that are none, each by itself as one that nobody draws.
char32_t nextCharacter(std::string_view& text) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const unsigned first = byte(0);
  const std::size_t more = first < 0x80 ? 0 : first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : first >= 0xC0 ? 1 : 0;
  char32_t out = more > 0 ? first & (0x3FU >> more) : first < 0x80 ? first : 0;
  for (std::size_t k = 1; k <= more; ++k) {
    if ((byte(k) & 0xC0U) != 0x80) {
      text.remove_prefix(1);
      return 0;
    }
    out = (out << 6) | (byte(k) & 0x3FU);
  }
  text.remove_prefix(more + 1);
  return out;
}

}  // namespace

std::vector<Letter> lettersOf(std::string_view text) {
  std::vector<Letter> out;
  while (!text.empty()) out.push_back(findLetter(nextCharacter(text)).value_or(Letter{&kBox}));
  return out;
}

std::string_view firstUndrawn(std::string_view text) {
  while (!text.empty()) {
    const std::string_view from = text;
    if (!findLetter(nextCharacter(text))) return from.substr(0, from.size() - text.size());
  }
  return {};
}

}  // namespace medulla
