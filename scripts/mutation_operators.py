"""Small mistakes that a line of C++ can have: comparisons, signs, constants, dropped statements and branches, swapped
arguments, numbers off by one. For sources as clang-format leaves them here: a space on both sides of a binary operator, none
inside a template's brackets."""
import dataclasses
import re


@dataclasses.dataclass(frozen=True)
class Mutant:
    file: str  # relative to the package
    find: str  # text that is replaced, from its offset on
    replace: str
    offset: int
    line: int  # number, from 1
    before: str  # the whole line, stripped
    after: str
    why: str  # the operator, or a semantic mistake in words

    def applied(self, text):
        assert text.startswith(self.find, self.offset)
        return text[:self.offset] + self.replace + text[self.offset + len(self.find):]

    def __str__(self):
        return f'{self.file}:{self.line} [{self.why}] {self.before} -> {self.after}'


def masked(text):
    """The text with blanks in place of comments, strings, characters and the preprocessor's lines; of the same length."""
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*'
    return re.sub(pattern, lambda m: re.sub(r'[^\n]', ' ', m[0]), text, flags=re.DOTALL | re.MULTILINE)


# (operator, pattern, replacements of its first group)
TOKENS = [
    ('comparison', r' (<|<=|>|>=|==|!=) ',
     {'<': ['<='], '<=': ['<'], '>': ['>='], '>=': ['>'], '==': ['!='], '!=': ['==']}),
    ('logic', r' (&&|\|\|) ', {'&&': ['||'], '||': ['&&']}),
    ('negation', r'[( ](!)[\w(]', {'!': ['']}),
    ('arithmetic', r'[\w)\]}] (\+|-|\*|/|\+=|-=|\*=|/=) ',
     {'+': ['-'], '-': ['+'], '*': ['/'], '/': ['*'], '+=': ['-='], '-=': ['+='], '*=': ['/='], '/=': ['*=']}),
    ('sign', r'(?:[(,=?:{<>*/+-] |\(|\{|\[|return )(-)[A-Za-z_(]', {'-': ['']}),
    ('order', r'\b(std::min|std::max|begin|end|top|bottom|left|right)\b(?=[(.])',
     {'std::min': ['std::max'], 'std::max': ['std::min'], 'begin': [], 'end': [], 'top': ['bottom'], 'bottom': ['top'],
      'left': ['right'], 'right': ['left']}),
]
NUMBER = r'(?<![\w.<])(\d+\.\d*(?:e-?\d+)?f?|\d+(?:e-?\d+)?u?)(?![\w.>])'
CALL = r'\b([\w:.]+)\(([\w.\->\[\]]+), ([\w.\->\[\]]+)([,)])'
SYMMETRIC = r'(?:std::)?(?:min|max|hypot)|_mm\d*_(?:add|and|avg|cmpeq|max|min|mul|mullo|or|sad|xor)_\w+'  # in two arguments
KEYWORDS = r'(?:return|using|typedef|const|auto|static|constexpr|struct|class|enum|namespace|throw|break|continue|case|public|' \
           r'private|if|for|while|else|do|template|friend|delete|explicit|inline|extern|default|switch|try|catch)\b'
STATEMENT = r'(?:\+\+|--)?[\w:.\->\[\]()*]+(?:\(.*\)| (?:[+*/|&^-]|<<|>>)?= .*|\+\+|--)?;'


def changed_number(number):
    """Off by one for whole numbers, else the double."""
    digits = number.rstrip('fu')
    if re.fullmatch(r'\d+', digits):
        return f'{int(digits) + 1}{number[len(digits):]}'
    value = float(digits)
    return '1.0' + number[len(digits):] if value == 0 else f'({number} * 2)'


def balanced(text):
    return text.count('(') == text.count(')') and text.count('{') == text.count('}')


def condition(line):
    """The begin and the end of what stands in `if (...)`, None where the line has no whole one."""
    found = re.search(r'\bif \(', line)
    if not found:
        return None
    depth = 1
    for i in range(found.end(), len(line)):
        depth += {'(': 1, ')': -1}.get(line[i], 0)
        if depth == 0:
            return None if ';' in line[found.end():i] else (found.end(), i)
    return None


def is_statement(stripped, previous):
    """Whether a line is a statement of its own that a compiler would not miss, and does more than to reserve memory."""
    return (re.fullmatch(STATEMENT, stripped) and not re.match(KEYWORDS, stripped) and balanced(stripped)
            and '.reserve(' not in stripped
            and re.search(r'(?:[{};:)]|\belse)$', previous) and '(' + stripped != '(;')


def replacements(line, previous):
    """Yields (operator, begin, end, text) for one masked line; `previous` is the last line before it that is not blank."""
    if re.match(r'\s*(?:template|static_assert|using|namespace|class|struct|enum|typedef)\b', line):
        return
    for name, pattern, table in TOKENS:
        for match in re.finditer(pattern, line):
            for text in table[match[1]]:
                yield name, match.start(1), match.end(1), text
    for match in re.finditer(NUMBER, line):
        yield 'number', match.start(1), match.end(1), changed_number(match[1])
    for match in re.finditer(CALL, line):
        if match[2] != match[3] and not re.fullmatch(SYMMETRIC, match[1]):
            yield 'arguments', match.start(2), match.end(3), f'{match[3]}, {match[2]}'
    stripped = line.strip()
    if is_statement(stripped, previous):
        begin = line.index(stripped)
        yield 'statement', begin, begin + len(stripped), ';'
    where = condition(line)
    if where:
        yield 'branch', *where, 'false'


def mutants(file, text, lines=None):
    """Every mutant of a source, or of some of its lines."""
    mask = masked(text)
    offset, previous, found = 0, '{', []
    for number, (line, original) in enumerate(zip(mask.split('\n'), text.split('\n')), 1):
        if lines is None or number in lines:
            for name, begin, end, replacement in replacements(line, previous):
                after = original[:begin] + replacement + original[end:]
                found.append(Mutant(file, original[begin:end], replacement, offset + begin, number, original.strip(),
                                    after.strip(), name))
        if line.strip():
            previous = line.strip()
        offset += len(original) + 1
    return found
