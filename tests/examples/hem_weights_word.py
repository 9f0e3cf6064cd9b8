"""The word of hem_weights.py: what sessions call it, and which parameters they may ask for. An installed package brings
it into every server's catalogue by an entry point of the group `tryon.effects`: hem_weights = "hem_weights_word:WORD".
"""

from tryon_solver.effect_words.fields import Edges, Number, Rows
from tryon_solver.effect_words.word import EffectWord

LINE = (Edges("along", "where they are sewn in", needed=True), Number("mass", "of all of them", "kg", high=1.0))
WORD = EffectWord(
    "hem_weights",
    "Weights in a hem",
    "small weights that hang a hem straight",
    (Rows("lines", "edges of the pattern that have some", needed=True, fields=LINE),),
    lined=True,
    module="hem_weights",
)
