#include "meshing/detail/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <limits>

#include "core/error.h"

namespace limber::meshing::detail {

namespace {

constexpr std::string_view blanks = " \t\r\v\f";

bool is_windows_not_a_number(std::string_view rest) {  // the tail of 1.#QNAN, 1.#IND, 1.#INF
  return rest.size() > 1 && rest[0] == '#';
}

std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

bool parse_number(std::string_view word, double& value) {
  word = without_plus(word);
  const char *begin = word.data(), *end = begin + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(word).c_str(), nullptr);  // 0 or infinite
  if (error == std::errc::invalid_argument) return false;
  if (stop == end) return true;
  if (!is_windows_not_a_number({stop, std::size_t(end - stop)})) return false;
  value = std::numeric_limits<double>::quiet_NaN();
  return true;
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  word = without_plus(word);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && stop == word.data() + word.size();
}

std::string without_byte_order_mark(std::string bytes) {
  if (bytes.starts_with("\xef\xbb\xbf")) return bytes.substr(3);
  const bool little = bytes.starts_with("\xff\xfe");
  if (!little && !bytes.starts_with("\xfe\xff")) return bytes;
  std::string text;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    const char low = bytes[i + (little ? 0 : 1)], high = bytes[i + (little ? 1 : 0)];
    text += high == 0 && low >= 0 ? low : '?';
  }
  return text;
}

TextScanner::TextScanner(std::string_view text, std::string_view file, char comment)
    : text_(text), file_(file), comment_(comment) {}

bool TextScanner::next_line() {
  while (next_ < text_.size()) {
    std::size_t end = text_.find_first_of("\n\r", next_);
    if (end == std::string_view::npos) end = text_.size();
    rest_of_line_ = text_.substr(next_, end - next_);
    next_ = end + (text_.substr(end, 2) == "\r\n" ? 2 : 1);
    ++line_number_;
    if (comment_) rest_of_line_ = rest_of_line_.substr(0, rest_of_line_.find(comment_));
    if (rest_of_line_.find_first_not_of(blanks) != std::string_view::npos) return true;
  }
  rest_of_line_ = {};
  return false;
}

std::string_view TextScanner::next_word() {
  const std::size_t begin = rest_of_line_.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return rest_of_line_ = {};
  const std::size_t end = std::min(rest_of_line_.find_first_of(blanks, begin), rest_of_line_.size());
  const std::string_view word = rest_of_line_.substr(begin, end - begin);
  rest_of_line_.remove_prefix(end);
  return word;
}

std::string_view TextScanner::rest_of_line() {
  std::string_view rest = rest_of_line_;
  rest_of_line_ = {};
  rest.remove_prefix(std::min(rest.find_first_not_of(blanks), rest.size()));
  return rest.substr(0, rest.find_last_not_of(blanks) + 1);
}

double TextScanner::next_number(const char* what) {
  const std::string_view word = next_word();
  double value = 0;
  if (word.empty()) complain(fmt::format("{} is missing", what));
  if (!parse_number(word, value))
    complain(fmt::format("{}: \"{}\" is not a number", what, word.substr(0, 40)));
  return value;
}

std::int64_t TextScanner::next_integer(const char* what) {
  const std::string_view word = next_word();
  std::int64_t value = 0;
  if (word.empty()) complain(fmt::format("{} is missing", what));
  if (!parse_integer(word, value))
    complain(fmt::format("{}: \"{}\" is not a whole number", what, word.substr(0, 40)));
  return value;
}

bool TextScanner::ends_within_a_word() const {
  return !text_.empty() && text_.back() != '\n' && blanks.find(text_.back()) == std::string_view::npos;
}

void TextScanner::complain(const std::string& what) const {
  const bool cut = next_ >= text_.size() && !text_.empty() && text_.back() != '\n' && text_.back() != '\r';
  throw InputError(fmt::format("{}:{}: {}{}", file_, line_number_, what,
                               cut ? "; the file ends in the middle of this line, it looks cut short" : ""));
}

}  // namespace limber::meshing::detail
