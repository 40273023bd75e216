"""One cusp as a discrete system, and the Newton solve that ends in a verdict."""
