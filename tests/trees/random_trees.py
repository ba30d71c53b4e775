#!/usr/bin/env python3
"""Random documents of built-in nodes of BehaviorTree.CPP 4, one a line, for holding one engine against another.

Not among them: Timeout, Delay and Sleep, whose time passes otherwise; Switch4 to 6, LoopBool, SetBlackboard and
UnsetBlackboard, of which traces.txt has documents that were written by hand.

Every leaf and every condition adds a letter to the entry `log` when it acts; `t` is the number of the tick. Leaves that
run for a while are Preconditions that say RUNNING until a tick has come.

usage: random_trees.py nodes|scripts SEED COUNT"""
import random
import sys
from xml.sax.saxutils import quoteattr

CONTROL = ["Sequence", "AsyncSequence", "SequenceWithMemory", "ReactiveSequence", "Fallback", "AsyncFallback",
           "ReactiveFallback", "Parallel", "ParallelAll", "IfThenElse", "WhileDoElse", "Switch2", "Switch3", "TryCatch"]
# No Precondition over others: what becomes of its condition after a halt differs, on purpose.
DECORATORS = ["Inverter", "ForceSuccess", "ForceFailure", "Repeat", "RetryUntilSuccessful", "KeepRunningUntilFailure",
              "RunOnce", "LoopInt", "LoopString", "LoopDouble", "SkipUnlessUpdated", "WaitValueUpdate"]


class Nodes:
    def __init__(self, seed, depth):
        self.random, self.letters, self.subtrees = random.Random(seed), 0, []
        main = self.node(self.random.randint(1, depth))
        trees = "".join(f'<BehaviorTree ID="T{i}">{tree}</BehaviorTree>' for i, tree in enumerate(self.subtrees))
        self.document = ('<root BTCPP_format="4" main_tree_to_execute="Main">'
                         f'<BehaviorTree ID="Main">{main}</BehaviorTree>{trees}</root>')

    def one_of(self, *choices):
        return self.random.choice(choices)

    def letter(self):
        self.letters += 1
        turn, letter = divmod(self.letters - 1, 26)
        return chr(ord("a") + letter) + (str(turn) if turn else "")

    def log(self, text):
        return quoteattr(f"@log += '{text}'")

    def condition(self):
        number = self.random.randint
        return quoteattr(self.one_of(
            f"@t >= {number(1, 8)}", f"@t < {number(1, 8)}", f"@t == {number(1, 6)}", f"@n > {number(0, 4)}",
            f"(@n += 1) < {number(1, 6)}", "true", "false", f"@t != {number(1, 5)} && @n <= {number(0, 5)}",
            f"1 <= @t <= {number(2, 7)}", "!(@t > 3)", f"@s == 'x' || @t > {number(2, 6)}"))

    def attributes(self):
        text, letter = "", self.letter()
        for name, share in (("_failureIf", 0.12), ("_successIf", 0.12), ("_skipIf", 0.18), ("_while", 0.12)):
            if self.random.random() < share:
                text += f" {name}={self.condition()}"
        for name, share in (("_onHalted", 0.5), ("_onSuccess", 0.2), ("_onFailure", 0.2), ("_post", 0.15)):
            if self.random.random() < share:
                text += f" {name}={self.log(letter + name[3].lower())}"
        return text

    def leaf(self):
        extra, letter, kind = self.attributes(), self.letter(), self.random.random()
        if kind < 0.22:
            return f"<Script code={self.log(letter)}{extra}/>"
        if kind < 0.36:
            return f"<ScriptCondition code={self.condition()}{extra}/>"
        if kind < 0.66:
            inner = self.one_of("<AlwaysSuccess/>", "<AlwaysFailure/>", f"<Script code={self.log(letter)}/>")
            until = quoteattr(f"@t >= {self.random.randint(1, 7)}")
            return f'<Precondition if={until} else="RUNNING"{extra}>{inner}</Precondition>'
        if kind < 0.80:
            return f"<{self.one_of('AlwaysSuccess', 'AlwaysFailure')}{extra}/>"
        if kind < 0.84:
            return f"<Script code={quoteattr('@s := ' + self.one_of(repr('x'), repr('y')))}{extra}/>"
        if kind < 0.88:
            return f'<WasEntryUpdated entry="{{@s}}"{extra}/>'
        if kind < 0.94:
            return f"<Script code={quoteattr(f'@n += {self.random.randint(1, 2)}')}{extra}/>"
        return f"<Script code={quoteattr(f'loc := {self.random.randint(0, 2)}; @n = loc + @n')}{extra}/>"

    def node(self, depth):
        if depth <= 0 or self.random.random() < 0.12:
            return self.leaf()
        extra, kind = self.attributes(), self.random.random()
        if kind < 0.60:
            return self.control(self.one_of(*CONTROL), extra, depth)
        if kind < 0.93:
            return self.decorator(self.one_of(*DECORATORS), extra, depth)
        inner = self.node(depth - 1)
        self.subtrees.append(inner)
        remap = self.one_of("", ' _autoremap="true"', ' loc="{n}"', ' loc="4"')
        return f'<SubTree ID="T{len(self.subtrees) - 1}"{remap}{extra}/>'

    def control(self, tag, extra, depth):
        count = self.random.randint(1, 4)
        if tag in ("IfThenElse", "WhileDoElse"):
            count = self.random.randint(2, 3)
        if tag == "TryCatch":
            count = self.random.randint(2, 4)
        if tag.startswith("Switch"):
            count = int(tag[-1]) + 1
            extra += f' variable="{self.one_of("{@s}", "{@s}", "2", "x")}"'
            for case in range(1, count):
                extra += f' case_{case}="{self.one_of("0", "1", "2", "3", "x", "y", "1.0")}"'
        if tag == "Parallel" and self.random.random() < 0.7:
            extra += f' success_count="{self.one_of(-1, -2, 1, 2, count, 0)}"'
        if tag == "Parallel" and self.random.random() < 0.7:
            extra += f' failure_count="{self.one_of(-1, 1, 2, count)}"'
        if tag == "ParallelAll" and self.random.random() < 0.7:
            extra += f' max_failures="{self.one_of(-1, 1, 2, count, 0)}"'
        return f"<{tag}{extra}>{''.join(self.node(depth - 1) for _ in range(count))}</{tag}>"

    def decorator(self, tag, extra, depth):
        extra += {"Repeat": f' num_cycles="{self.random.randint(0, 4)}"',
                  "RetryUntilSuccessful": f' num_attempts="{self.random.randint(0, 4)}"',
                  "RunOnce": self.one_of("", ' then_skip="true"', ' then_skip="false"'),
                  "LoopInt": f' queue="{self.one_of("1;2;3", "5", "7;8")}" value="{{@v}}"',
                  "LoopDouble": ' queue="1.5;2.5" value="{@w}"',
                  "LoopString": f' queue="p;q;r" value="{{@u}}" if_empty="{self.one_of("SUCCESS", "FAILURE", "SKIPPED")}"',
                  "SkipUnlessUpdated": ' entry="{@s}"',
                  "WaitValueUpdate": ' entry="{@s}"'}.get(tag, "")
        return f"<{tag}{extra}>{self.node(depth - 1)}</{tag}>"


class Scripts:
    def __init__(self, seed):
        self.random = random.Random(seed)
        # Numbers alone mostly work out; with texts among them it is mostly told what does not fit.
        self.texts = self.random.random() < 0.3
        scripts = "".join(
            f"<Script code={quoteattr('; '.join(self.statement() for _ in range(self.random.randint(1, 2))))}"
            ' _onSuccess="n += 1"/>' for _ in range(self.random.randint(1, 3)))
        # What each has come to; one that was never set ends the tree here.
        shown = "".join(f"""<Script code="log = log .. ' {name}=' .. {name}"/>""" for name in "abcd")
        self.document = ('<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence>'
                         f"""<Script code="a := 1; b := 2.5; c := 'q'; d := 0.0"/>{scripts}{shown}</Sequence></BehaviorTree></root>""")

    def statement(self):
        sign = self.random.choice([":=", ":=", ":=", "=", "+=", "-=", "*=", "/="])
        return f"{self.random.choice('abcd' if self.texts else 'abd')} {sign} {self.value(self.random.randint(0, 3))}"

    def value(self, depth):
        kind = self.random.random()
        if depth <= 0 or kind < 0.25:
            numbers = ["0", "1", "2", "3.5", "0x1F", "1e2", "true", "false", "7", "10", "2.0", "a", "b"]
            texts = ["'x'", "'y'", "''", "'12'", "'1.5z'", "c", "d"]
            return self.random.choice(numbers + texts if self.texts else numbers)
        inner = [self.value(depth - 1) for _ in range(3)]
        if kind < 0.35:
            return self.random.choice("-!~") + inner[0]
        if kind < 0.75:
            signs = ["+", "-", "*", "/", "+", "*", *(["..", "&", "|", "^", "&&", "||"] if self.texts else ["&&", "&"])]
            return f"{inner[0]} {self.random.choice(signs)} {inner[1]}"
        if kind < 0.9:
            return f"{inner[0]} {self.random.choice(['==', '!=', '<', '>', '<=', '>='])} {inner[1]}"
        return f"({inner[0]})" if kind < 0.95 else f"({inner[0]} ? {inner[1]} : {inner[2]})"


def main():
    what, seed, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    for i in range(count):
        number = seed * 1_000_003 + i
        print(Scripts(number).document if what == "scripts" else Nodes(number, 4).document)


if __name__ == "__main__":
    main()
