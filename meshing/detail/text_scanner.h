// Lines and words of a text file, with the line number for every complaint.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace limber::meshing::detail {

// The value of a number as programs write it: 1, +1.5, -2e3, 1., nan, inf, 1.#QNAN; false when it is none.
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, std::int64_t& value);

// A byte order mark at the start is left out. UTF-16 (known by its mark) becomes one byte a character, those
// beyond ASCII a question mark: numbers and keywords are ASCII in every format.
std::string without_byte_order_mark(std::string bytes);

// The warning where ends_within_a_word().
inline constexpr const char* last_word_may_be_cut =
    "the last line has no end: if the file was cut short, its last number may have lost digits";

class TextScanner {
 public:
  // `comment` starts a comment that ends with the line; 0: there are none. Both must outlive the scanner.
  TextScanner(std::string_view text, std::string_view file, char comment);

  bool next_line();                 // to the next line that holds a word; false at the end of the text
  std::string_view next_word();     // of this line; empty at its end
  std::string_view rest_of_line();  // without the blanks round it; then the line is used up
  double next_number(const char* what);
  std::int64_t next_integer(const char* what);

  // Throws InputError: "file:line: what"; at a last line without its end it adds that the file looks cut
  // short.
  [[noreturn]] void complain(const std::string& what) const;
  int line() const { return line_number_; }
  bool ends_within_a_word() const;  // the text's last line has no end, and no blank after its last word

 private:
  std::string_view text_, rest_of_line_;
  std::string_view file_;
  std::size_t next_ = 0;
  int line_number_ = 0;
  char comment_;
};

}  // namespace limber::meshing::detail
